// The user's disk under refinement: connectivity, and for every vertex where it lies on the input
// (guarantee G7).
//
// Vertices 0 .. input_vertices - 1 are the user's. The weights of vertices added by splits are
// multiples of 2^-52 that sum to one exactly (midpoints, at sixteenths, or rounded to them);
// whether faces keep their orientation within their parent is therefore decided exactly. A collar,
// if there is one, is a ring of triangles glued around the boundary that only exists during the
// solve: it makes the boundary free to lie anywhere inside a box. Its faces have no parent
// (kInvalid), its vertices no support.
#pragma once

#include <array>
#include <vector>

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
// The point at (1 - share) a + share b.
Support between(const Support& a, const Support& b, double share);
// The same, with weights rounded to multiples of 2^-52 that sum to one exactly.
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
  VertexId split_edge(HalfedgeId h) { return split_edge(h, 0.5); }
  // Splits at the given share from source to target; `share` comes from exact_share().
  VertexId split_edge(HalfedgeId h, double share);
  // The share itself if it is a multiple of 1/16 and weights there are exact in double with bits to
  // spare, else 1/2.
  double exact_share(HalfedgeId h, double share) const;
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

// Precondition: `surface` was validated as a disk and outlives the result.
RefinedSurface make_refined_surface(const Surface& surface);

// The same surface inside a ring of triangles, whose outer boundary has at least four vertices.
// Vertices keep their ids, the collar's come after them. Marks are forgotten.
RefinedSurface with_collar(const RefinedSurface& surface);

// Without collar, dead faces and vertices that no face uses; the input's vertices keep their ids,
// others move up. `old_vertex`, #V, receives the former id of each. Marks are forgotten.
RefinedSurface compacted(const RefinedSurface& surface, std::vector<VertexId>& old_vertex);

}  // namespace flipfree::mesh
