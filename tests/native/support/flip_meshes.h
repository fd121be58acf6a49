// Closed combinatorial meshes for tests of intrinsic triangulations.
#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::test {

// The surface's faces, with every boundary edge joined to one new vertex (the last).
inline intrinsic::FlipMesh closed_mesh(const mesh::Surface& surface) {
  const auto n = static_cast<Index>(surface.vertices.rows());
  const mesh::Adjacency& adjacency = surface.adjacency();
  std::vector<std::array<Index, 3>> faces;
  for (Index f = 0; f < surface.faces.rows(); ++f) {
    faces.push_back({surface.faces(f, 0), surface.faces(f, 1), surface.faces(f, 2)});
  }
  for (HalfedgeId h = 0; h < 3 * static_cast<Index>(surface.faces.rows()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    faces.push_back({mesh::target(surface.faces, h), mesh::source(surface.faces, h), n});
  }
  intrinsic::FlipMesh mesh;
  std::map<std::pair<Index, Index>, HalfedgeId> ids;
  mesh.next.resize(faces.size() * 3);
  mesh.origin.resize(faces.size() * 3);
  Index edges = 0;
  for (const auto& f : faces) {
    std::array<HalfedgeId, 3> h{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = f[k], b = f[(k + 1) % 3];
      if (!ids.count({a, b})) {
        ids[{a, b}] = 2 * edges;
        ids[{b, a}] = 2 * edges + 1;
        ++edges;
      }
      h[k] = ids[{a, b}];
      mesh.origin[static_cast<std::size_t>(h[k])] = a;
    }
    for (std::size_t k = 0; k < 3; ++k) mesh.next[static_cast<std::size_t>(h[k])] = h[(k + 1) % 3];
  }
  return mesh;
}

}  // namespace flipfree::test
