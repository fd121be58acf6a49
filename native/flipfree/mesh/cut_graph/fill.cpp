#include "flipfree/mesh/cut_graph/fill.h"

namespace flipfree::mesh {

FilledSurface fill_holes(const Surface& surface,
                         const std::vector<std::vector<HalfedgeId>>& loops) {
  Eigen::Index added_faces = 0;
  for (const auto& loop : loops) added_faces += static_cast<Eigen::Index>(loop.size());
  FilledSurface filled;
  Points3& vertices = filled.surface.vertices;
  Triangles& faces = filled.surface.faces;
  vertices.resize(surface.vertices.rows() + static_cast<Eigen::Index>(loops.size()), 3);
  vertices.topRows(surface.vertices.rows()) = surface.vertices;
  faces.resize(surface.faces.rows() + added_faces, 3);
  faces.topRows(surface.faces.rows()) = surface.faces;
  Eigen::Index next_face = surface.faces.rows();
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto center =
        static_cast<VertexId>(surface.vertices.rows() + static_cast<Eigen::Index>(i));
    Vector3 sum = Vector3::Zero();
    for (const HalfedgeId h : loops[i]) {
      sum += surface.vertices.row(source(surface.faces, h)).transpose();
      faces.row(next_face++) << target(surface.faces, h), source(surface.faces, h), center;
    }
    vertices.row(center) = (sum / static_cast<double>(loops[i].size())).transpose();
  }
  return filled;
}

}  // namespace flipfree::mesh
