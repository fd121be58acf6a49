// The combinatorial mesh of an intrinsic triangulation (thesis 4.4.2, Definitions 4.4-4.6) in flat
// arrays: half-edges as drawn above, with faces, and with a reflection where it is a
// cover.
//
// A surface with boundary is represented by its double cover (4.4.1): a mirrored copy glued along
// the boundary, with the reflection R on half-edges. R reverses orientation: R(a -> b) runs from
// R(b) to R(a), next(R(h)) = R(previous(h)) and R(opposite(h)) = opposite(R(h)). Labels say where
// an edge or face lies: in copy 1, in copy 2, on the symmetry line (parallel), across it
// (perpendicular); symmetric faces are triangles (t) or quadrilaterals (q).
//
// Deviation from the thesis: a quadrilateral face q is stored as two triangles, both labelled q,
// that meet in an edge labelled `diagonal`. The diagonal keeps its length, is never tested and has
// no reflection. Since a symmetric quadrilateral is an inscribed trapezoid under every symmetric
// metric, either diagonal gives the same angles (4.4.4); storing it as an edge lets every loop over
// faces see triangles only, and every symmetric flip be a short sequence of plain edge flips, which
// is also how an overlay replays it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {
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

struct FlipMesh {
  // Per half-edge, #H = 2 #E.
  std::vector<HalfedgeId> next;
  std::vector<VertexId> origin;

  static constexpr HalfedgeId opposite(HalfedgeId h) { return h ^ 1; }
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

enum class EdgeLabel : std::uint8_t { kOne, kTwo, kParallel, kPerpendicular, kDiagonal };
enum class FaceLabel : std::uint8_t { kOne, kTwo, kTriangle, kQuad };

struct IntrinsicMesh : FlipMesh {
  // Per half-edge.
  std::vector<FaceId> face;
  std::vector<HalfedgeId>
      reflection;  // empty for a closed surface; kInvalid for the halves of a diagonal
  // Per edge and face; empty for a closed surface (all are then kOne).
  std::vector<EdgeLabel> edge_label;
  std::vector<FaceLabel> face_label;
  // Per edge, for perpendicular ones: 1 if half-edge 2e runs from copy 2 to copy 1. It is what
  // tells the copies apart when a flip restores the two sides of a symmetric face whose
  // surroundings all lie on the symmetry line.
  std::vector<std::uint8_t> starts_in_two;
  // Per face: one of its half-edges.
  std::vector<HalfedgeId> face_halfedge;
  // Per vertex of this mesh: the vertex of the user's mesh whose unknown it shares. The first
  // #input vertices are the user's own; the mirror images of interior vertices follow.
  std::vector<VertexId> unknown;

  std::size_t face_count() const { return face_halfedge.size(); }
  std::size_t vertex_count() const { return unknown.size(); }
  bool symmetric() const { return !reflection.empty(); }

  EdgeLabel label_of_edge(EdgeId e) const {
    return edge_label.empty() ? EdgeLabel::kOne : edge_label[at(e)];
  }
  // For half-edges of perpendicular edges: does it run from copy 1 to copy 2?
  bool leaves_one(HalfedgeId h) const { return (starts_in_two[at(h >> 1)] != 0) == ((h & 1) != 0); }
};

// The edges of a mesh in corner order.
struct InputEdges {
  std::vector<HalfedgeId> halfedge;  // #E: the corner first seen
  std::vector<Index> of_corner;      // 3 #F
};
InputEdges number_edges(const mesh::Adjacency& adjacency);

// The mesh of a user's surface and where its corners went.
struct IntrinsicSetup {
  IntrinsicMesh mesh;  // closed, or the double cover if the surface has a boundary
  std::vector<HalfedgeId>
      input_halfedge;  // 3 #F: half-edge of the (first copy's) face f from corner k to k + 1
  std::vector<bool> on_boundary;  // per user's vertex
};

// Precondition: `faces` is a valid manifold oriented mesh without isolated vertices. Faces 0 .. #F
// - 1 of the mesh are the user's in the same order; in a double cover #F + f is the mirror image of
// f. Cost: O(#F).
IntrinsicSetup build_intrinsic_mesh(Index vertex_count, const Triangles& faces);

// Makes a and b, and their opposites, mirror images of each other.
void pair_by_reflection(IntrinsicMesh& mesh, HalfedgeId a, HalfedgeId b);

// One plain flip, faces included; labels and reflection are not touched.
void flip_edge(IntrinsicMesh& mesh, EdgeId e);

// Empty if all invariants hold (orbits, faces, reflection, label compatibility of Proposition 2);
// otherwise what is broken. For tests and debug builds; O(#H).
std::string find_broken_invariant(const IntrinsicMesh& mesh);

}  // namespace flipfree::intrinsic
