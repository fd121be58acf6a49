// Half-edges and their rotation, components, boundary loops, Euler characteristic and genus of
// triangles.
#pragma once

#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// As Surface::adjacency(), of triangles that belong to no surface. Precondition: `faces` passed
// validate() (manifold, oriented). Cost: O(#F), counting sort by the lower vertex.
Adjacency build_adjacency(Index vertex_count, const Triangles& faces);

inline VertexId source(const Triangles& faces, HalfedgeId h) { return faces(h / 3, h % 3); }
inline VertexId target(const Triangles& faces, HalfedgeId h) {
  const HalfedgeId n = next_corner(h);
  return faces(n / 3, n % 3);
}

// Outgoing half-edge after h in counter-clockwise order around its source; kInvalid past a
// boundary.
inline HalfedgeId rotate_ccw(const Adjacency& adjacency, HalfedgeId h) {
  return adjacency.opposite[at(previous_corner(h))];
}
// Outgoing half-edge after h in clockwise order around its source; kInvalid past a boundary.
inline HalfedgeId rotate_cw(const Adjacency& adjacency, HalfedgeId h) {
  const HalfedgeId o = adjacency.opposite[at(h)];
  return o == kInvalid ? kInvalid : next_corner(o);
}

// Calls visit(h) for the half-edges that leave v, counter-clockwise; none if v is isolated.
template <typename Visit>
void for_each_outgoing(const Adjacency& adjacency, VertexId v, const Visit& visit) {
  const HalfedgeId first = adjacency.vertex_halfedge[at(v)];
  for (HalfedgeId h = first; h != kInvalid;) {
    visit(h);
    h = rotate_ccw(adjacency, h);
    if (h == first) break;
  }
}

// Closed chains of boundary vertices, surface on the left, each starting at its smallest vertex id,
// ordered by it.
std::vector<std::vector<VertexId>> boundary_loops(const Triangles& faces,
                                                  const Adjacency& adjacency);
// The same chains as boundary half-edges.
std::vector<std::vector<HalfedgeId>> boundary_halfedge_loops(const Triangles& faces,
                                                             const Adjacency& adjacency);

struct Components {
  Index count = 0;
  std::vector<Index> of_face;  // #F
};
// Faces joined across edges that are not cut (one flag per half-edge; none: all). Components are
// numbered by their smallest face.
Components components_between(const Adjacency& adjacency, const std::vector<char>& cut);
inline Components face_components(const Adjacency& adjacency) {
  return components_between(adjacency, {});
}

struct Topology {
  Index vertices = 0;  // used by a face
  Index edges = 0;
  Index faces = 0;
  Index boundary_loops = 0;
  Index components = 0;
  Index euler() const { return vertices - edges + faces; }
  // Sum of the genera of the components.
  Index genus() const { return (2 * components - boundary_loops - euler()) / 2; }
  bool is_disk() const { return components == 1 && boundary_loops == 1 && euler() == 1; }
};
Topology topology(const Triangles& faces, const Adjacency& adjacency);

}  // namespace flipfree::mesh
