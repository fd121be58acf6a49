#include "flipfree/mesh/topology.h"

#include <algorithm>

namespace flipfree::mesh {

std::vector<std::vector<HalfedgeId>> boundary_halfedge_loops(const Triangles& faces,
                                                             const Adjacency& adjacency) {
  const auto is_boundary = [&](HalfedgeId h) { return adjacency.opposite[at(h)] == kInvalid; };
  std::vector<std::vector<HalfedgeId>> loops;
  std::vector<char> seen(adjacency.opposite.size(), 0);
  const auto vertex_count = static_cast<VertexId>(adjacency.vertex_halfedge.size());
  for (VertexId v = 0; v < vertex_count; ++v) {
    const HalfedgeId start = adjacency.vertex_halfedge[at(v)];
    if (start == kInvalid || !is_boundary(start) || seen[at(start)]) continue;
    std::vector<HalfedgeId>& loop = loops.emplace_back();
    HalfedgeId h = start;
    do {
      seen[at(h)] = 1;
      loop.push_back(h);
      h = adjacency.vertex_halfedge[at(target(faces, h))];
    } while (h != start);
  }
  return loops;
}

std::vector<std::vector<VertexId>> boundary_loops(const Triangles& faces,
                                                  const Adjacency& adjacency) {
  std::vector<std::vector<VertexId>> loops;
  for (const std::vector<HalfedgeId>& halfedges : boundary_halfedge_loops(faces, adjacency)) {
    std::vector<VertexId>& loop = loops.emplace_back();
    loop.reserve(halfedges.size());
    for (const HalfedgeId h : halfedges) loop.push_back(source(faces, h));
  }
  return loops;
}

Components face_components(const Adjacency& adjacency) {
  const std::size_t face_count = adjacency.opposite.size() / 3;
  Components components;
  components.of_face.assign(face_count, kInvalid);
  std::vector<FaceId> stack;
  for (std::size_t seed = 0; seed < face_count; ++seed) {
    if (components.of_face[seed] != kInvalid) continue;
    components.of_face[seed] = components.count;
    stack.push_back(static_cast<FaceId>(seed));
    while (!stack.empty()) {
      const FaceId f = stack.back();
      stack.pop_back();
      for (Index k = 0; k < 3; ++k) {
        const HalfedgeId o = adjacency.opposite[at(3 * f + k)];
        if (o == kInvalid || components.of_face[at(o / 3)] != kInvalid) continue;
        components.of_face[at(o / 3)] = components.count;
        stack.push_back(o / 3);
      }
    }
    ++components.count;
  }
  return components;
}

Topology topology(const Triangles& faces, const Adjacency& adjacency) {
  Topology t;
  t.faces = static_cast<Index>(faces.rows());
  t.vertices = static_cast<Index>(std::count_if(adjacency.vertex_halfedge.begin(),
                                                adjacency.vertex_halfedge.end(),
                                                [](HalfedgeId h) { return h != kInvalid; }));
  const auto boundary = static_cast<Index>(
      std::count(adjacency.opposite.begin(), adjacency.opposite.end(), kInvalid));
  t.edges = (3 * t.faces + boundary) / 2;
  t.boundary_loops = static_cast<Index>(boundary_halfedge_loops(faces, adjacency).size());
  t.components = face_components(adjacency).count;
  return t;
}

}  // namespace flipfree::mesh
