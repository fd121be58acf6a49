#include "flipfree/seamless/exact/boundaries.h"

#include <algorithm>
#include <utility>

#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/seamless/bordered/boundary_cones.h"

namespace flipfree::seamless {

std::vector<SurfacePart> parts_with_boundaries(const mesh::Surface& surface,
                                               const mesh::Adjacency& adjacency,
                                               const std::vector<Index>& cones) {
  const mesh::CutMesh whole =
      mesh::cut_along(surface.faces, adjacency, mesh::EdgeFlags(adjacency.opposite.size(), 0));
  std::vector<SurfacePart> parts;
  for (mesh::Chart& chart : mesh::split_into_charts(surface.vertices, whole)) {
    SurfacePart part;
    for (const VertexId v : chart.vertices) {
      const VertexId own = whole.vertex_origin[at(v)];
      part.vertices.push_back(own);
      part.cones.push_back(cones[at(own)]);
      const HalfedgeId h = adjacency.vertex_halfedge[at(own)];
      if (adjacency.opposite[at(h)] != kInvalid) continue;
      part.bordered = true;
      part.corners_given = part.corners_given || cones[at(own)] != kNotGiven;
    }
    part.surface = std::move(chart.surface);
    part.faces = std::move(chart.faces);
    parts.push_back(std::move(part));
  }
  return parts;
}

std::vector<Index> with_corners(const std::vector<SurfacePart>& parts,
                                const std::vector<char>& freed, const std::vector<Index>& cones,
                                ExecutionContext& context) {
  std::vector<Index> all = cones;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parts[i].bordered || freed[i] != 0) continue;
    context.check();
    const std::vector<Index> own = aligned_cones(parts[i].surface, parts[i].cones, context);
    for (std::size_t v = 0; v < own.size(); ++v) all[at(parts[i].vertices[v])] = own[v];
  }
  return all;
}

std::vector<char> aligned_faces(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                const std::vector<Index>& cones) {
  const mesh::Components parts = mesh::face_components(adjacency);
  std::vector<char> aligned(at(parts.count), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[at(h)] == kInvalid &&
        cones[at(mesh::source(surface.faces, h))] != kNotGiven)
      aligned[at(parts.of_face[at(h / 3)])] = 1;
  }
  std::vector<char> of_face;
  for (const Index part : parts.of_face) of_face.push_back(aligned[at(part)]);
  return of_face;
}

std::vector<distortion::StraightEdge> straight_where(const std::vector<char>& aligned,
                                                     const std::vector<FaceId>& parent,
                                                     const distortion::CutMap& cut,
                                                     const mesh::Adjacency& adjacency) {
  std::vector<distortion::StraightEdge> edges = distortion::straight_boundary(cut, adjacency);
  std::erase_if(edges, [&](const distortion::StraightEdge& edge) {
    return aligned[at(parent[at(edge.h / 3)])] == 0;
  });
  return edges;
}

}  // namespace flipfree::seamless
