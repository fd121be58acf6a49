#include "flipfree/embedding/disk/require_disk.h"

#include <string>

#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::embedding {

using Size = std::size_t;

void require_disk_with_boundary(const Triangles& faces, Index vertex_count,
                                const std::vector<VertexId>& loop, const Points2& boundary) {
  if (static_cast<Index>(loop.size()) != boundary.rows()) {
    throw_invalid(ErrorCode::kBadBoundary,
                  "The boundary loop has " + std::to_string(loop.size()) + " vertices, but " +
                      std::to_string(boundary.rows()) +
                      " positions were given. Give one position per vertex.");
  }
  std::vector<Index> place(static_cast<Size>(vertex_count), kInvalid);
  for (Size i = 0; i < loop.size(); ++i) {
    if (loop[i] < 0 || loop[i] >= vertex_count) {
      throw_invalid(ErrorCode::kIndexOutOfRange,
                    "The boundary loop names vertex " + std::to_string(loop[i]) +
                        ", which does not exist. List vertices of the mesh.");
    }
    if (place[static_cast<Size>(loop[i])] != kInvalid) {
      throw_invalid(
          ErrorCode::kBadBoundary,
          "The boundary loop passes vertex " + std::to_string(loop[i]) + " twice. List it once.",
          ElementKind::kVertex, {loop[i]});
    }
    place[static_cast<Size>(loop[i])] = static_cast<Index>(i);
  }
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  Index edges = 0;
  Index used = 0;
  Index boundary_edges = 0;
  for (const HalfedgeId h : adjacency.vertex_halfedge) used += h != kInvalid;
  for (HalfedgeId h = 0; h < faces.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<Size>(h)];
    edges += o < h;  // also counts boundary edges: kInvalid < h
    if (o != kInvalid) continue;
    ++boundary_edges;
    const Index i = place[static_cast<Size>(mesh::source(faces, h))];
    const Index j = place[static_cast<Size>(mesh::target(faces, h))];
    if (i != kInvalid && j == (i + 1) % static_cast<Index>(loop.size())) continue;
    throw_invalid(
        ErrorCode::kBadBoundary,
        "The boundary edge from vertex " + std::to_string(mesh::source(faces, h)) + " to " +
            std::to_string(mesh::target(faces, h)) +
            " is not in the boundary loop. List the whole boundary in order, surface on the left.",
        ElementKind::kEdge, {mesh::source(faces, h), mesh::target(faces, h)});
  }
  if (boundary_edges != static_cast<Index>(loop.size()) ||
      used - edges + static_cast<Index>(faces.rows()) != 1 ||
      mesh::face_components(adjacency).count != 1) {
    throw_invalid(ErrorCode::kNotADisk,
                  "The mesh is not a disk with this boundary. Cut it open to a disk first.");
  }
}

}  // namespace flipfree::embedding
