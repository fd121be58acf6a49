// Triangulated disk under reversible edge collapses (thesis 3.2.2, Definitions 3.6 and 3.10).
//
// Flat corner table as in mesh/adjacency.h. A collapse unlinks two faces and leaves their entries
// untouched; undoing it in reverse order links them back ("dancing links"), so that the record of a
// collapse is one half-edge and a split restores the connectivity bit for bit.
//
//            a                           a
//          / | \                       / | \.
//        y/  |p \                     /  |  \.
//        /   |   \x                  /   |   \.
//  ...  m -- h -> v0  ...    ==>    ...   v0  ...
//        \   |   /w                  \   |   /
//        z\  |  /                     \  |  /
//          \ | /                       \ | /
//            b                           b
//
// m is merged into v0 along h = (m -> v0): the faces A = (m, v0, a) and B = (v0, m, b) vanish, the
// fan of m from a counter-clockwise to b goes to v0.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::embedding {

class PlanarMesh {
 public:
  PlanarMesh(const Triangles& faces, Index vertex_count, const std::vector<VertexId>& loop);

  Index face_count() const { return static_cast<Index>(vertex_.size()) / 3; }
  Index vertex_count() const { return static_cast<Index>(outgoing_.size()); }
  VertexId source(HalfedgeId h) const { return vertex_[static_cast<std::size_t>(h)]; }
  VertexId target(HalfedgeId h) const { return source(next_corner(h)); }
  // Corner across from edge h within its face.
  VertexId apex(HalfedgeId h) const { return source(previous_corner(h)); }
  HalfedgeId opposite(HalfedgeId h) const { return opposite_[static_cast<std::size_t>(h)]; }
  // Outgoing half-edge counter-clockwise after h; kInvalid past a boundary.
  HalfedgeId rotate(HalfedgeId h) const { return opposite(previous_corner(h)); }
  // An outgoing half-edge; for a boundary vertex the first of its fan.
  HalfedgeId outgoing(VertexId v) const { return outgoing_[static_cast<std::size_t>(v)]; }
  bool is_boundary(VertexId v) const { return boundary_[static_cast<std::size_t>(v)] != 0; }
  bool is_alive(FaceId f) const { return alive_[static_cast<std::size_t>(f)] != 0; }
  // Number of neighbours.
  Index degree(VertexId v) const { return degree_[static_cast<std::size_t>(v)]; }

  // May h's source be merged into its target? Both ends inner, and exactly two common neighbours
  // (Definition 3.1). Cost: sum over the source's neighbours of the smaller of two degrees.
  bool can_collapse(HalfedgeId h) const;
  // Merges source(h) into target(h). Precondition: can_collapse(h).
  void collapse(HalfedgeId h);
  // Undoes collapse(h). Precondition: every later collapse has been undone. Afterwards source(h) is
  // the vertex that comes back.
  void split(HalfedgeId h);

  // Are v and w joined by an edge? Cost: the smaller degree.
  bool adjacent(VertexId v, VertexId w) const;

  const std::vector<VertexId>& corners() const { return vertex_; }
  const std::vector<HalfedgeId>& opposites() const { return opposite_; }

 private:
  std::vector<VertexId> vertex_;
  std::vector<HalfedgeId> opposite_;
  std::vector<HalfedgeId> outgoing_;
  std::vector<Index> degree_;
  std::vector<char> boundary_;
  std::vector<char> alive_;
};

}  // namespace flipfree::embedding
