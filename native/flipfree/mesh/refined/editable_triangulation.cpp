#include "flipfree/mesh/refined/editable_triangulation.h"

#include <algorithm>
#include <cstddef>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"

namespace flipfree::mesh {

EditableTriangulation::EditableTriangulation(Index vertex_count, const Triangles& faces) {
  const Adjacency adjacency = build_adjacency(vertex_count, faces);
  source_.assign(faces.data(), faces.data() + faces.size());
  opposite_ = adjacency.opposite;
  outgoing_ = adjacency.vertex_halfedge;
  mark_.assign(source_.size(), kUnmarked);
  parent_.resize(at(faces.rows()));
  for (std::size_t f = 0; f < parent_.size(); ++f) parent_[f] = static_cast<FaceId>(f);
}

HalfedgeId EditableTriangulation::find(VertexId a, VertexId b) const {
  const HalfedgeId first = outgoing(a);
  for (HalfedgeId h = first; h != kInvalid;) {
    if (target(h) == b) return h;
    const HalfedgeId in = previous_corner(h);
    if (opposite(in) == kInvalid && source(in) == b) return in;
    h = opposite(in);
    if (h == first) break;
  }
  return kInvalid;
}

void EditableTriangulation::set_mark(HalfedgeId h, Index mark) {
  mark_[at(h)] = mark;
  const HalfedgeId o = opposite(h);
  if (o != kInvalid) mark_[at(o)] = mark;
}

void EditableTriangulation::link(HalfedgeId a, HalfedgeId b) {
  if (a != kInvalid) opposite_[at(a)] = b;
  if (b != kInvalid) opposite_[at(b)] = a;
}

FaceId EditableTriangulation::add_face(VertexId a, VertexId b, VertexId c, FaceId parent) {
  FaceId f = kInvalid;
  if (free_.empty()) {
    f = face_slots();
    source_.resize(source_.size() + 3);
    opposite_.resize(source_.size());
    mark_.resize(source_.size());
    parent_.push_back(kInvalid);
  } else {
    f = free_.back();
    free_.pop_back();
  }
  const std::array<VertexId, 3> corners = {a, b, c};
  for (Index k = 0; k < 3; ++k) {
    source_[at(3 * f + k)] = corners[static_cast<std::size_t>(k)];
    opposite_[at(3 * f + k)] = kInvalid;
    mark_[at(3 * f + k)] = kUnmarked;
  }
  parent_[at(f)] = parent;
  return f;
}

VertexId EditableTriangulation::split_edge(HalfedgeId h) {
  //        c                 c
  //       / \               /|\.
  //    f /   \           f / | \ f'
  //     a--h--b    ->     a--s--b
  //    g \   /           g \ | / g'
  //       \ /               \|/
  //        d                 d
  const HalfedgeId o = opposite(h);
  const HalfedgeId h_next = next_corner(h);
  const VertexId b = target(h);
  const VertexId c = apex(h);
  const Index edge_mark = mark(h);
  const VertexId s = vertex_count();
  outgoing_.push_back(kInvalid);

  const FaceId f2 = add_face(s, b, c, parent(h / 3));
  const HalfedgeId bc_opposite = opposite(h_next);
  link(3 * f2 + 1, bc_opposite);
  mark_[at(3 * f2 + 1)] = mark(h_next);
  source_[at(h_next)] = s;
  link(h_next, 3 * f2 + 2);
  mark_[at(h_next)] = kUnmarked;
  mark_[at(3 * f2)] = edge_mark;
  outgoing_[at(s)] = 3 * f2;
  if (outgoing(b) == h_next) outgoing_[at(b)] = 3 * f2 + 1;
  if (o == kInvalid) return s;

  const HalfedgeId o_previous = previous_corner(o);
  const VertexId d = source(o_previous);
  const FaceId g2 = add_face(b, s, d, parent(o / 3));
  const HalfedgeId db_opposite = opposite(o_previous);
  link(3 * g2 + 2, db_opposite);
  mark_[at(3 * g2 + 2)] = mark(o_previous);
  source_[at(o)] = s;
  link(o_previous, 3 * g2 + 1);
  mark_[at(o_previous)] = kUnmarked;
  link(3 * f2, 3 * g2);
  mark_[at(3 * g2)] = edge_mark;
  if (outgoing(b) == o) outgoing_[at(b)] = 3 * g2;
  if (outgoing(d) == o_previous) outgoing_[at(d)] = 3 * g2 + 2;
  return s;
}

VertexId EditableTriangulation::split_face(FaceId f) {
  const Triangle old = corners(f);
  const VertexId s = vertex_count();
  outgoing_.push_back(kInvalid);
  // f keeps its first edge; its two other edges go to new faces.
  const FaceId f1 = add_face(old[1], old[2], s, parent(f));
  const FaceId f2 = add_face(old[2], old[0], s, parent(f));
  link(3 * f1, opposite(3 * f + 1));
  mark_[at(3 * f1)] = mark(3 * f + 1);
  link(3 * f2, opposite(3 * f + 2));
  mark_[at(3 * f2)] = mark(3 * f + 2);
  if (outgoing(old[1]) == 3 * f + 1) outgoing_[at(old[1])] = 3 * f1;
  if (outgoing(old[2]) == 3 * f + 2) outgoing_[at(old[2])] = 3 * f2;
  source_[at(3 * f + 2)] = s;
  mark_[at(3 * f + 1)] = kUnmarked;
  mark_[at(3 * f + 2)] = kUnmarked;
  link(3 * f + 1, 3 * f1 + 2);
  link(3 * f1 + 1, 3 * f2 + 2);
  link(3 * f2 + 1, 3 * f + 2);
  outgoing_[at(s)] = 3 * f + 2;
  return s;
}

void EditableTriangulation::flip_edge(HalfedgeId h) {
  const HalfedgeId o = opposite(h);
  const VertexId a = source(h);
  const VertexId b = target(h);
  const VertexId c = apex(h);
  const VertexId d = apex(o);
  debug_require("EditableTriangulation::flip_edge", "the other diagonal is no edge",
                [&] { return find(c, d) == kInvalid; });
  const std::array<FaceId, 2> faces = {h / 3, o / 3};
  const std::array<Triangle, 2> triangles = {Triangle{c, a, d}, Triangle{d, b, c}};
  const std::array<FaceId, 2> parents = {parent(h / 3), parent(o / 3)};
  replace(faces, triangles, parents);
}

void EditableTriangulation::replace(std::span<const FaceId> faces,
                                    std::span<const Triangle> triangles,
                                    std::span<const FaceId> parents) {
  struct OutlineEdge {
    VertexId source, target;
    HalfedgeId opposite;
    Index mark;
  };
  std::vector<OutlineEdge> outline;
  std::vector<VertexId> touched;
  Index old_boundary = 0;
  Index new_boundary = 0;
  const auto removed = [&](HalfedgeId h) {
    return std::find(faces.begin(), faces.end(), h / 3) != faces.end();
  };
  for (const FaceId f : faces) {
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      touched.push_back(source(h));
      const HalfedgeId o = opposite(h);
      if (o == kInvalid) ++old_boundary;
      if (o == kInvalid || !removed(o)) outline.push_back({source(h), target(h), o, mark(h)});
    }
  }
  for (std::size_t i = faces.size(); i-- > 0;) {
    for (Index k = 0; k < 3; ++k) source_[at(3 * faces[i] + k)] = kInvalid;
    free_.push_back(faces[i]);
  }
  for (const VertexId v : touched) outgoing_[at(v)] = kInvalid;
  std::vector<HalfedgeId> made;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const FaceId f = add_face(triangles[t][0], triangles[t][1], triangles[t][2], parents[t]);
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) made.push_back(h);
  }
  for (const HalfedgeId h : made) {
    const auto outer = std::find_if(outline.begin(), outline.end(), [&](const OutlineEdge& e) {
      return e.source == source(h) && e.target == target(h);
    });
    if (outer != outline.end()) {
      link(h, outer->opposite);
      mark_[at(h)] = outer->mark;
      continue;
    }
    const auto mate = std::find_if(made.begin(), made.end(), [&](HalfedgeId g) {
      return source(g) == target(h) && target(g) == source(h);
    });
    if (mate != made.end()) {
      link(h, *mate);
    } else {
      ++new_boundary;
    }
  }
  if (new_boundary > old_boundary)
    throw InternalError("replace: the triangles do not fill the outline");
  for (const HalfedgeId h : made) outgoing_[at(source(h))] = h;
  for (const OutlineEdge& e : outline) {
    if (e.opposite == kInvalid) continue;
    outgoing_[at(e.target)] = e.opposite;
    if (outgoing(e.source) == kInvalid) outgoing_[at(e.source)] = next_corner(e.opposite);
  }
  // Of boundary vertices the one on the boundary.
  for (const VertexId v : touched) {
    const HalfedgeId first = outgoing(v);
    HalfedgeId h = first;
    while (h != kInvalid && !is_boundary(h)) {
      h = rotate_cw(h);
      if (h == first) break;
    }
    outgoing_[at(v)] = h;
  }
}

std::vector<FaceId> EditableTriangulation::star(VertexId v) const {
  std::vector<FaceId> faces;
  for_each_outgoing(v, [&](HalfedgeId h) { faces.push_back(h / 3); });
  return faces;
}

Triangles EditableTriangulation::faces(std::vector<FaceId>* slots) const {
  std::vector<FaceId> live;
  for (FaceId f = 0; f < face_slots(); ++f) {
    if (alive(f)) live.push_back(f);
  }
  Triangles result(static_cast<Eigen::Index>(live.size()), 3);
  for (std::size_t i = 0; i < live.size(); ++i) {
    for (Index k = 0; k < 3; ++k) result(static_cast<Eigen::Index>(i), k) = source(3 * live[i] + k);
  }
  if (slots != nullptr) *slots = std::move(live);
  return result;
}

void EditableTriangulation::check_invariants() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw InternalError(std::string("editable triangulation: ") + what);
  };
  std::vector<bool> on_boundary(outgoing_.size(), false);
  for (HalfedgeId h = 0; h < halfedge_slots(); ++h) {
    if (!alive(h / 3)) continue;
    const HalfedgeId o = opposite(h);
    if (o == kInvalid) {
      on_boundary[static_cast<std::size_t>(source(h))] = true;
      continue;
    }
    require(alive(o / 3) && opposite(o) == h, "opposites do not match");
    require(source(o) == target(h) && target(o) == source(h), "opposite edges differ");
    require(mark(o) == mark(h), "marks differ");
  }
  for (VertexId v = 0; v < vertex_count(); ++v) {
    const HalfedgeId h = outgoing(v);
    if (h == kInvalid) continue;
    require(alive(h / 3) && source(h) == v, "outgoing half-edge belongs to another vertex");
    require(!on_boundary[at(v)] || is_boundary(h), "outgoing is not on the boundary");
  }
}

}  // namespace flipfree::mesh
