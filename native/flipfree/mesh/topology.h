// Components, boundary loops, Euler characteristic and genus of a triangle mesh.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {

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
// Faces joined across edges. Components are numbered by their smallest face.
Components face_components(const Adjacency& adjacency);

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
