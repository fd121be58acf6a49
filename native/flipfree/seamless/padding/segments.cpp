#include "flipfree/seamless/padding/segments.h"

#include <algorithm>
#include <cstddef>

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

}  // namespace

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
  mesh::Adjacency apart = adjacency;
  for (HalfedgeId h = 0; at(h) < apart.opposite.size(); ++h) {
    if (sides.on_branch(h)) apart.opposite[at(h)] = kInvalid;
  }
  const mesh::Components components = mesh::face_components(apart);
  result.of_side.assign(at(sides.count()), kInvalid);
  std::vector<char> flat(at(sides.count()), 0);  // is there a flat sector before the side
  for (Index s = 0; s < sides.count(); ++s) {
    flat[at(s)] = std::count(cut.flat_sectors.begin(), cut.flat_sectors.end(), sides.first(s)) > 0;
  }
  std::vector<Index> start(at(components.count), kInvalid);
  for (Index s = sides.count() - 1; s >= 0; --s) {
    if (flat[at(s)] == 0) start[at(components.of_face[at(sides.first(s) / 3)])] = s;
  }
  for (Index c = 0; c < components.count; ++c) {
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

std::vector<CutPiece> cut_pieces(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                                 const CutSegments& segments, const std::vector<Index>& cones) {
  mesh::EdgeFlags flags(adjacency.opposite.size(), 0);
  for (const auto& branch : cut.branches) {
    for (const HalfedgeId h : branch) flags[at(h)] = flags[at(adjacency.opposite[at(h)])] = 1;
  }
  const mesh::CutMesh open = mesh::cut_along(cut.surface.faces, adjacency, flags);
  std::vector<double> angle;
  for (const VertexId v : open.vertex_origin) angle.push_back(cones[at(v)] * kQuarterTurn);
  const auto set = [&](HalfedgeId h, double quarters) {
    angle[at(open.faces(h / 3, h % 3))] = quarters * kQuarterTurn;
  };
  for (HalfedgeId h = 0; at(h) < flags.size(); ++h) {
    if (flags[at(h)]) set(h, 2.0);
  }
  for (const CutSegment& segment : segments.segments)
    set(side_halfedges(cut, adjacency, segment.sides.front()).front(), 1.0);
  std::vector<CutPiece> pieces;
  for (mesh::Chart& chart : mesh::split_into_charts(cut.surface.vertices, open)) {
    CutPiece& piece = pieces.emplace_back(CutPiece{std::move(chart), {}});
    for (const VertexId v : piece.chart.vertices) piece.angle.push_back(angle[at(v)]);
  }
  return pieces;
}

}  // namespace flipfree::seamless
