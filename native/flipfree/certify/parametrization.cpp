#include "flipfree/certify/parametrization.h"

namespace flipfree::certify {

void set_refinement(Parametrization& map, const mesh::RefinedSurface& refined) {
  const mesh::Provenance where = mesh::provenance_of(refined);
  map.surface = mesh::to_surface(refined);
  map.parent_face = where.face;
  map.vertex_parent.clear();
  map.vertex_barycentric.resize(map.surface.vertices.rows(), 3);
  for (std::size_t v = 0; v < where.vertex.size(); ++v) {
    map.vertex_parent.push_back(where.vertex[v].face);
    map.vertex_barycentric.row(static_cast<Eigen::Index>(v)) = where.vertex[v].weight;
  }
}

void set_identity_provenance(Parametrization& map) {
  const Eigen::Index face_count = map.surface.faces.rows();
  const Eigen::Index vertex_count = map.surface.vertices.rows();
  map.parent_face.resize(static_cast<std::size_t>(face_count));
  map.vertex_parent.assign(static_cast<std::size_t>(vertex_count), kInvalid);
  map.vertex_barycentric = Points3::Zero(vertex_count, 3);
  for (FaceId f = 0; f < face_count; ++f) {
    map.parent_face[static_cast<std::size_t>(f)] = f;
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = map.surface.faces(f, k);
      if (map.vertex_parent[static_cast<std::size_t>(v)] != kInvalid) continue;
      map.vertex_parent[static_cast<std::size_t>(v)] = f;
      map.vertex_barycentric(v, k) = 1.0;
    }
  }
}

}  // namespace flipfree::certify
