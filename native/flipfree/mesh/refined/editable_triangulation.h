// A triangulation that can be refined and coarsened in place: flat half-edge arrays with local
// operations in O(valence).
//
// Half-edge h = 3 f + k runs from corner k to corner k + 1 of face f, as in mesh/adjacency.h. Every
// edge carries a mark (both its half-edges the same; kUnmarked at first) that splits hand on, every
// face the parent it lies in. Faces can die; their slots are kept and skipped (`alive`).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {

class EditableTriangulation {
 public:
  static constexpr Index kUnmarked = -1;
  using Triangle = std::array<VertexId, 3>;

  EditableTriangulation() = default;
  // Precondition: manifold, oriented. Each face is its own parent.
  EditableTriangulation(Index vertex_count, const Triangles& faces);

  Index vertex_count() const { return static_cast<Index>(outgoing_.size()); }
  Index halfedge_slots() const { return static_cast<Index>(source_.size()); }
  Index face_slots() const { return halfedge_slots() / 3; }
  bool alive(FaceId f) const { return source_[at(3 * f)] != kInvalid; }

  VertexId source(HalfedgeId h) const { return source_[at(h)]; }
  VertexId target(HalfedgeId h) const { return source_[at(next_corner(h))]; }
  VertexId apex(HalfedgeId h) const {
    return source_[at(previous_corner(h))];
  }  // third corner of h's face
  HalfedgeId opposite(HalfedgeId h) const { return opposite_[at(h)]; }
  bool is_boundary(HalfedgeId h) const { return opposite_[at(h)] == kInvalid; }
  // One of the two half-edges of h's edge, the same for both.
  HalfedgeId edge(HalfedgeId h) const {
    const HalfedgeId o = opposite(h);
    return o != kInvalid && o < h ? o : h;
  }
  // Outgoing half-edge; of a boundary vertex the one on the boundary, from which rotate_ccw visits
  // the whole fan.
  HalfedgeId outgoing(VertexId v) const { return outgoing_[at(v)]; }
  HalfedgeId rotate_ccw(HalfedgeId h) const { return opposite_[at(previous_corner(h))]; }
  HalfedgeId rotate_cw(HalfedgeId h) const {
    const HalfedgeId o = opposite(h);
    return o == kInvalid ? kInvalid : next_corner(o);
  }
  bool is_boundary_vertex(VertexId v) const {
    return outgoing(v) == kInvalid || is_boundary(outgoing(v));
  }
  // The half-edge from a to b, or, if only the other direction exists (boundary), that one;
  // kInvalid if no edge.
  HalfedgeId find(VertexId a, VertexId b) const;
  Triangle corners(FaceId f) const { return {source(3 * f), source(3 * f + 1), source(3 * f + 2)}; }

  Index mark(HalfedgeId h) const { return mark_[at(h)]; }
  void set_mark(HalfedgeId h, Index mark);
  FaceId parent(FaceId f) const { return parent_[at(f)]; }
  void set_parent(FaceId f, FaceId parent) { parent_[at(f)] = parent; }

  // Puts a new vertex on the edge of h = a -> b and joins it to the apexes; afterwards h runs from
  // a to it.
  VertexId split_edge(HalfedgeId h);
  // Puts a new vertex into face f.
  VertexId split_face(FaceId f);
  // Replaces an inner edge by the other diagonal. Precondition: the other diagonal is not an edge
  // yet.
  void flip_edge(HalfedgeId h);
  // Replaces connected faces by other triangles with the same outline, of the given parents (one
  // per triangle). Boundary edges among the outline may give way to new ones (a boundary vertex is
  // left out). They take the slots of the first of the faces, in order. Marks of outline edges
  // stay, inner edges become unmarked. Vertices inside that no triangle uses become isolated.
  void replace(std::span<const FaceId> faces, std::span<const Triangle> triangles,
               std::span<const FaceId> parents);

  // Faces around v, counter-clockwise.
  std::vector<FaceId> star(VertexId v) const;
  // Calls visit(outgoing half-edge) counter-clockwise around v.
  template <typename Visit>
  void for_each_outgoing(VertexId v, const Visit& visit) const {
    const HalfedgeId first = outgoing(v);
    for (HalfedgeId h = first; h != kInvalid;) {
      visit(h);
      h = rotate_ccw(h);
      if (h == first) break;
    }
  }

  // The faces alive, without gaps; `slots`, if given, receives the slot of each.
  Triangles faces(std::vector<FaceId>* slots = nullptr) const;
  // Throws InternalError if the arrays contradict each other. Cost: O(#F).
  void check_invariants() const;

 private:
  FaceId add_face(VertexId a, VertexId b, VertexId c, FaceId parent);
  void link(HalfedgeId a, HalfedgeId b);

  std::vector<VertexId> source_;      // 3 #slots; kInvalid if dead
  std::vector<HalfedgeId> opposite_;  // 3 #slots
  std::vector<Index> mark_;           // 3 #slots
  std::vector<FaceId> parent_;        // #slots
  std::vector<HalfedgeId> outgoing_;  // #V
  std::vector<FaceId> free_;
};

}  // namespace flipfree::mesh
