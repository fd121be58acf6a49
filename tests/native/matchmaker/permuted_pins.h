// Pins that change places inside a grid whose boundary stays.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "flipfree/matchmaker/request/constraints.h"

namespace flipfree::test {

// Boundary at its place, inner vertices of the grid pinned to each other's places.
inline matchmaker::Constraints permuted_pins(const mesh::Surface& surface,
                                             const mesh::RefinedSurface& refined, std::size_t count,
                                             unsigned seed) {
  const auto place = [&](VertexId v) -> Vector2 {
    return surface.vertices.row(v).head<2>().transpose();
  };
  matchmaker::Constraints constraints;
  for (const VertexId v : refined.boundary) constraints.outline.push_back(place(v));
  std::vector<VertexId> inner;
  for (VertexId v = 0; v < refined.mesh.vertex_count(); ++v) {
    if (!refined.mesh.is_boundary_vertex(v)) inner.push_back(v);
  }
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < count; ++i)
    std::swap(inner[i], inner[i + random() % (inner.size() - i)]);
  std::vector<VertexId> to(inner.begin(), inner.begin() + static_cast<std::ptrdiff_t>(count));
  for (std::size_t i = 0; i < count; ++i) std::swap(to[i], to[i + random() % (count - i)]);
  for (std::size_t i = 0; i < count; ++i) constraints.pins.push_back({inner[i], place(to[i])});
  std::sort(constraints.pins.begin(), constraints.pins.end(),
            [](const auto& a, const auto& b) { return a.vertex < b.vertex; });
  return constraints;
}

}  // namespace flipfree::test
