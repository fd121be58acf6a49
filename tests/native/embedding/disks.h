// Disks for the embedding tests: a surface, its boundary loop and where the boundary goes.
#pragma once

#include <vector>

#include "flipfree/embedding/disk.h"
#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::test {

struct Disk {
  mesh::Surface surface;
  std::vector<VertexId> loop;
  Points2 boundary;
  Index vertex_count() const { return static_cast<Index>(surface.vertices.rows()); }
};

inline Disk make_disk(mesh::Surface surface, embedding::BoundaryShape shape) {
  Disk disk;
  disk.surface = std::move(surface);
  const mesh::Adjacency& adjacency = disk.surface.adjacency();
  disk.loop = mesh::boundary_loops(disk.surface.faces, adjacency).front();
  const std::vector<double> lengths(disk.loop.size(), 1.0);
  disk.boundary = embedding::place_boundary(shape, lengths);
  return disk;
}

// Closed surface without its last face, onto the triangle.
inline Disk opened(mesh::Surface surface) {
  surface.faces = Triangles(surface.faces.triangles().topRows(surface.faces.rows() - 1));
  return make_disk(std::move(surface), embedding::BoundaryShape::kTriangle);
}

}  // namespace flipfree::test
