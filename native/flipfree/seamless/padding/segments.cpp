#include "flipfree/seamless/padding/segments.h"

#include <algorithm>
#include <cstddef>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"

namespace flipfree::seamless {

namespace {

// The sides of a cut as a permutation.
class BoundarySides {
 public:
  BoundarySides(const AdmissibleCut& cut, const mesh::Adjacency& adjacency)
      : adjacency_(adjacency), cut_(cut), side_(adjacency.opposite.size(), kInvalid) {
    for (std::size_t b = 0; b < cut.branches.size(); ++b) {
      if (cut.branches[b].empty()) throw InternalError("a branch without edges");
      for (const HalfedgeId h : cut.branches[b]) {
        claim(h, static_cast<Index>(2 * b));
        claim(adjacency.opposite[at(h)], static_cast<Index>(2 * b + 1));
      }
    }
    for (const HalfedgeId h : cut.flat_sectors) {
      if (side_[at(h)] == kInvalid || first(side_[at(h)]) != h)
        throw InternalError("a flat sector that does not begin with a branch");
    }
  }

  Index count() const { return static_cast<Index>(2 * cut_.branches.size()); }
  bool on_branch(HalfedgeId h) const { return side_[at(h)] != kInvalid; }
  HalfedgeId first(Index side) const {
    const std::vector<HalfedgeId>& branch = cut_.branches[at(side / 2)];
    return side % 2 == 0 ? branch.front() : adjacency_.opposite[at(branch.back())];
  }
  // The side that follows on the boundary, surface on the left.
  Index next(Index side) const {
    const std::vector<HalfedgeId>& branch = cut_.branches[at(side / 2)];
    const HalfedgeId last = side % 2 == 0 ? branch.back() : adjacency_.opposite[at(branch.front())];
    HalfedgeId h = next_corner(last);
    while (!on_branch(h)) h = next_corner(adjacency_.opposite[at(h)]);
    const Index following = side_[at(h)];
    if (first(following) != h) throw InternalError("a branch that ends on another one's inside");
    return following;
  }

 private:
  void claim(HalfedgeId h, Index side) {
    if (side_[at(h)] != kInvalid) throw InternalError("two branches share an edge");
    side_[at(h)] = side;
  }

  const mesh::Adjacency& adjacency_;
  const AdmissibleCut& cut_;
  std::vector<Index> side_;  // per half-edge
};

std::vector<Index> components(const BoundarySides& sides, const mesh::Adjacency& adjacency,
                              Index& component_count) {
  const auto face_count = static_cast<Index>(adjacency.opposite.size() / 3);
  DisjointSets sets(face_count);
  for (HalfedgeId h = 0; h < 3 * face_count; ++h) {
    if (!sides.on_branch(h)) sets.join(h / 3, adjacency.opposite[at(h)] / 3);
  }
  std::vector<Index> number(at(face_count), kInvalid);
  std::vector<Index> of_face(at(face_count));
  component_count = 0;
  for (FaceId f = 0; f < face_count; ++f) {
    Index& n = number[at(sets.find(f))];
    if (n == kInvalid) n = component_count++;
    of_face[at(f)] = n;
  }
  return of_face;
}

}  // namespace

Index CutSegments::size(Index component) const {
  return first[at(component) + 1] - first[at(component)];
}

Index CutSegments::next(Index segment) const {
  const Index component = segments[at(segment)].component;
  return segment + 1 < first[at(component) + 1] ? segment + 1 : first[at(component)];
}

Index CutSegments::previous(Index segment) const {
  const Index component = segments[at(segment)].component;
  return segment > first[at(component)] ? segment - 1 : first[at(component) + 1] - 1;
}

std::vector<HalfedgeId> side_halfedges(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                                       Index side) {
  std::vector<HalfedgeId> halfedges = cut.branches[at(side / 2)];
  if (side % 2 == 0) return halfedges;
  std::reverse(halfedges.begin(), halfedges.end());
  for (HalfedgeId& h : halfedges) h = adjacency.opposite[at(h)];
  return halfedges;
}

CutSegments cut_segments(const AdmissibleCut& cut, const mesh::Adjacency& adjacency) {
  const BoundarySides sides(cut, adjacency);
  CutSegments result;
  Index component_count = 0;
  result.component_of_face = components(sides, adjacency, component_count);
  result.of_side.assign(at(sides.count()), kInvalid);
  if (cut.branches.empty()) {
    result.first.assign(at(component_count) + 1, 0);
    return result;
  }
  std::vector<char> flat(at(sides.count()), 0);  // is there a flat sector before the side
  for (Index s = 0; s < sides.count(); ++s) {
    flat[at(s)] = std::count(cut.flat_sectors.begin(), cut.flat_sectors.end(), sides.first(s)) > 0;
  }
  std::vector<Index> start(at(component_count), kInvalid);
  for (Index s = sides.count() - 1; s >= 0; --s) {
    if (flat[at(s)] == 0) start[at(result.component_of_face[at(sides.first(s) / 3)])] = s;
  }
  for (Index c = 0; c < component_count; ++c) {
    result.first.push_back(static_cast<Index>(result.segments.size()));
    if (start[at(c)] == kInvalid) throw InternalError("a component of the cut has no corner");
    Index s = start[at(c)];
    do {
      if (flat[at(s)] == 0) result.segments.push_back({c, {}});
      result.segments.back().sides.push_back(s);
      result.of_side[at(s)] = static_cast<Index>(result.segments.size()) - 1;
      s = sides.next(s);
    } while (s != start[at(c)]);
  }
  result.first.push_back(static_cast<Index>(result.segments.size()));
  if (std::count(result.of_side.begin(), result.of_side.end(), kInvalid) > 0)
    throw InternalError("a component of the cut has several boundary loops");
  return result;
}

std::vector<EqualizationRow> equalization_rows(const CutSegments& segments) {
  std::vector<EqualizationRow> rows;
  for (Index i = 0; at(i) < segments.segments.size(); ++i) {
    EqualizationRow row;
    row.segment = i;
    for (const Index side : segments.segments[at(i)].sides)
      row.mates.push_back(segments.of_side[at(mate_of(side))]);
    const auto mates_sides = [&](Index j) { return segments.segments[at(j)].sides.size(); };
    if (row.mates.size() == 1) {
      // The complex one of the two has the row; of two simple ones the first.
      const Index j = row.mates.front();
      if (mates_sides(j) > 1 || j < i) continue;
    } else if (std::any_of(row.mates.begin(), row.mates.end(),
                           [&](Index j) { return mates_sides(j) > 1; })) {
      throw InternalError("both sides of a branch lie at flat sectors");
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

OpenCut open_cut(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                 const CutSegments& segments, const std::vector<Index>& cones) {
  mesh::EdgeFlags flags(adjacency.opposite.size(), 0);
  for (const auto& branch : cut.branches) {
    for (const HalfedgeId h : branch) flags[at(h)] = flags[at(adjacency.opposite[at(h)])] = 1;
  }
  OpenCut open{mesh::cut_along(cut.surface.faces, adjacency, flags), {}};
  open.angle.resize(open.mesh.vertex_origin.size());
  for (std::size_t v = 0; v < open.angle.size(); ++v)
    open.angle[v] = cones[at(open.mesh.vertex_origin[v])] * kQuarterTurn;
  for (std::size_t h = 0; h < flags.size(); ++h) {
    const auto c = static_cast<HalfedgeId>(h);
    if (flags[h]) open.angle[at(open.mesh.faces(c / 3, c % 3))] = 2.0 * kQuarterTurn;
  }
  for (const CutSegment& segment : segments.segments) {
    const HalfedgeId h = side_halfedges(cut, adjacency, segment.sides.front()).front();
    open.angle[at(open.mesh.faces(h / 3, h % 3))] = kQuarterTurn;
  }
  return open;
}

}  // namespace flipfree::seamless
