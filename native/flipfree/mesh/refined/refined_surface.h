// The user's disk under refinement: connectivity, and for every vertex where it lies on the input
// (guarantee G7).
//
// Vertices 0 .. input_vertices - 1 are the user's. The weights of vertices added by splits are
// multiples of 2^-52 that sum to one exactly (midpoints, or rounded to them);
// whether faces keep their orientation within their parent is therefore decided exactly. A collar,
// if there is one, is a ring of triangles glued around the boundary that only exists during the
// solve: it makes the boundary free to lie anywhere inside a box. Its faces have no parent
// (kInvalid), its vertices no support.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/refined/editable_triangulation.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// A point of the input surface: weights of at most three input vertices, sorted by vertex; unused
// entries are kInvalid.
struct Support {
  std::array<VertexId, 3> vertex = {kInvalid, kInvalid, kInvalid};
  std::array<double, 3> weight = {0.0, 0.0, 0.0};

  bool empty() const { return vertex[0] == kInvalid; }
  double of(VertexId v) const;
};
// The point at (1 - share) a + share b, with weights rounded to multiples of 2^-52 that sum to one
// exactly.
Support rounded_between(const Support& a, const Support& b, double share);

struct RefinedSurface {
  EditableTriangulation mesh;
  std::vector<Support> support;   // #V
  std::vector<Vector3> position;  // #V
  const Surface* input = nullptr;
  std::vector<VertexId> boundary;        // the input's boundary loop, surface on the left
  std::vector<VertexId> outer_boundary;  // boundary of the mesh: the collar's, or the same

  Index input_vertices() const { return static_cast<Index>(input->vertices.rows()); }
  bool in_collar(FaceId f) const { return mesh.parent(f) == kInvalid; }

  // Splits at the midpoint. The edge's two ends must have supports within one input face, or lie in
  // the collar.
  VertexId split_edge(HalfedgeId h);
  // Splits at the point `where` of the edge or of the face, usually found by rounded_between().
  // Whether the new faces keep their orientation in their parents is for the caller to check
  // beforehand.
  VertexId split_edge(HalfedgeId h, const Support& where);
  VertexId split_face(FaceId f, const Support& where);
  // Exact orientation of three points within input face `parent`: +1 if they turn as the face does.
  int orientation_in_parent(FaceId parent, VertexId a, VertexId b, VertexId c) const;
  int orientation_in_parent(FaceId parent, const Support& a, const Support& b,
                            const Support& c) const;
  // Where a support lies in space.
  Vector3 place(const Support& s) const;
};

// A surface before it is refined, with any boundaries, which are not set; it must outlive the
// result.
RefinedSurface unrefined(const Surface& surface);
// The same of a disk, with its boundary. Precondition: `surface` was validated as one.
RefinedSurface make_refined_surface(const Surface& surface);

// The same surface inside a ring of triangles, whose outer boundary has at least four vertices.
// Vertices keep their ids, the collar's come after them. Marks are forgotten.
RefinedSurface with_collar(const RefinedSurface& surface);

// Without collar, dead faces and vertices that no face uses; the input's vertices keep their ids,
// others move up. `old_vertex`, #V, receives the former id of each. Marks are forgotten.
RefinedSurface compacted(const RefinedSurface& surface, std::vector<VertexId>& old_vertex);

// The live faces as arrays, with all vertices.
Surface to_surface(const RefinedSurface& surface);
// Where these lie on the input. Vertices that no face uses have no place. Precondition: no collar.
Provenance provenance_of(const RefinedSurface& surface);

// A map of a refined surface, while it is being made.

struct RefinedMap {
  RefinedSurface surface;  // without collar
  Points2 uv;  // #V x 2, every face positive by exact test, all constraints met bit for bit
};

// Without the vertices that no face uses; the input's keep their ids, others move up.
RefinedMap compacted_map(const RefinedMap& map);

// What must hold of surfaces and maps under refinement wherever a stage hands them on.

// Empty if all invariants hold: those of the mesh (which throws), a support and a position per
// vertex, weights that are not negative and sum to one exactly, faces that lie in their parents and
// turn as these do. Otherwise what is broken. Cost: O(#F).
std::string find_broken_invariant(const RefinedSurface& surface);

// The same of a map: connectivity, one place per vertex, every face positive by exact test. Weights
// are not asked for: between stages the surface may be one in the plane that only helps to find the
// user's, whose weights are its coordinates, of either sign. What a stage hands on as a map of the
// user's surface is asked for find_broken_invariant() as well (matchmaker/match.cpp). `uv`: #V x 2.
std::string find_broken_map(const RefinedSurface& surface, const Points2& uv);

// Empty if this can be where `refined` lies on `input`: parents exist, weights are not negative and
// sum to one up to a rounding, and every face's corners lie in its parent.
// Otherwise what is broken. Cost: O(#F).
std::string find_broken_provenance(const Surface& input, const Triangles& refined,
                                   const Provenance& provenance);

}  // namespace flipfree::mesh
