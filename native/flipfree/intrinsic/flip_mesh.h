// The connectivity of a closed triangulation that is flipped: half-edges with two maps (thesis
// Definition 4.4), the base of every intrinsic triangulation here.
//
// next(h) walks around the face on the left of h, and opposite(h) = h ^ 1 is its other half, so
// that edge e owns the half-edges 2e and 2e + 1. Nothing else is assumed: a vertex may have valence
// 1, a face may be glued to itself, two vertices may share many edges. Faces are the orbits of
// `next`, always three half-edges long.
//
//                k               h  = i -> j, face (i, j, k) counter-clockwise
//              /   \             hn = next(h)  = j -> k
//         hp /       \ hn        hp = next(hn) = k -> i
//          /     h     \         o  = opposite(h) = j -> i
//        i ------------- j       on = next(o)  = i -> m
//          \     o     /         op = next(on) = m -> j
//         on \       / op
//              \   /
//                m
//
// Triangulations elsewhere that change are other things and share no code with this one: the
// editable triangulation (mesh/refined) has a boundary, corners of faces as half-edges, and faces
// that come and go; a signpost triangulation (refined_start) has a boundary and grows.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::intrinsic {

struct FlipMesh {
  // Per half-edge, #H = 2 #E.
  std::vector<HalfedgeId> next;
  std::vector<VertexId> origin;

  static constexpr HalfedgeId opposite(HalfedgeId h) { return h ^ 1; }
  static constexpr EdgeId edge(HalfedgeId h) { return h >> 1; }
  static constexpr HalfedgeId halfedge(EdgeId e) { return 2 * e; }

  std::size_t halfedge_count() const { return next.size(); }
  std::size_t edge_count() const { return next.size() / 2; }

  HalfedgeId next_of(HalfedgeId h) const { return next[at(h)]; }
  HalfedgeId previous(HalfedgeId h) const { return next[at(next[at(h)])]; }
  VertexId origin_of(HalfedgeId h) const { return origin[at(h)]; }
  VertexId target(HalfedgeId h) const { return origin[at(h ^ 1)]; }
  // The outgoing half-edge after h, counter-clockwise around the origin of h.
  HalfedgeId rotate_ccw(HalfedgeId h) const { return opposite(previous(h)); }
};

// Turns the edge counter-clockwise:
//     h = i -> j becomes m -> k in face (m, k, i), o = j -> i becomes k -> m in face (k, m, j);
//     all other half-edges keep their end points.
// Two flips give the edge back, reversed. Precondition: the edge's two faces differ.
void flip_edge(FlipMesh& mesh, EdgeId e);

// Do the two sides of e belong to one face?
bool is_glued_to_itself(const FlipMesh& mesh, EdgeId e);

// Every vertex has a half-edge. Cost: O(#H).
Index count_vertices(const FlipMesh& mesh);

// Empty if next and origin are what they should be; otherwise what is broken. Cost: O(#H).
std::string find_broken_invariant(const FlipMesh& mesh);
// Where an invariant is broken, for such messages.
std::string at_halfedge(const char* what, HalfedgeId h);

}  // namespace flipfree::intrinsic
