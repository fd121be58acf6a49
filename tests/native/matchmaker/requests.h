// Requests for match, and what a result must show.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "flipfree/certify/parametrization.h"
#include "flipfree/matchmaker/match.h"
#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::test {

inline std::vector<VertexId> boundary_of(const mesh::Surface& surface) {
  return mesh::boundary_loops(surface.faces, mesh::build_adjacency(surface)).front();
}

// Different vertices that are none of `held`, anywhere in the unit square.
inline matchmaker::MatchRequest random_pins(const mesh::Surface& surface, int count, unsigned seed,
                                            const std::vector<VertexId>& held = {}) {
  std::mt19937 random(seed);
  std::vector<char> used(static_cast<std::size_t>(surface.vertices.rows()), 0);
  for (const VertexId v : held) used[static_cast<std::size_t>(v)] = 1;
  matchmaker::MatchRequest request;
  while (static_cast<int>(request.points.size()) < count) {
    const auto v = static_cast<VertexId>(random() % static_cast<unsigned>(surface.vertices.rows()));
    if (used[static_cast<std::size_t>(v)]++ != 0) continue;
    const auto coordinate = [&] { return static_cast<double>(random()) * 0x1p-32; };
    const double u = coordinate();
    request.points.push_back({v, {u, coordinate()}});
  }
  return request;
}

// The whole boundary around the origin, at a distance that depends on the direction.
template <typename Radius>
void hold_boundary(const mesh::Surface& surface, const Radius& radius,
                   matchmaker::MatchRequest& request) {
  request.boundary_loop = boundary_of(surface);
  const auto n = static_cast<double>(request.boundary_loop.size());
  for (std::size_t i = 0; i < request.boundary_loop.size(); ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / n;
    request.boundary_uv.emplace_back(radius(angle) * std::cos(angle),
                                     radius(angle) * std::sin(angle));
  }
}

// The whole boundary where the surface has it in the plane.
inline void hold_as_it_is(const mesh::Surface& surface, matchmaker::MatchRequest& request) {
  request.boundary_loop = boundary_of(surface);
  for (const VertexId v : request.boundary_loop)
    request.boundary_uv.emplace_back(surface.vertices.row(v).head<2>().transpose());
}

// Certified, and every pinned vertex bit for bit where it shall be, in 64 and in 32 bits.
inline void expect_met(const certify::Parametrization& map,
                       const matchmaker::MatchRequest& request) {
  EXPECT_TRUE(map.certificate.ok);
  const auto expect_at = [&](VertexId v, const Vector2& uv) {
    for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
      if (map.surface.faces.data()[c] != v) continue;
      EXPECT_EQ(map.uv.row(c).transpose(), uv) << v;
      EXPECT_EQ(map.uv32.row(c).transpose(), uv.cast<float>()) << v;
    }
  };
  for (const matchmaker::PinnedVertex& p : request.points) expect_at(p.vertex, p.uv);
  for (std::size_t i = 0; i < request.boundary_loop.size(); ++i)
    expect_at(request.boundary_loop[i], request.boundary_uv[i]);
}

}  // namespace flipfree::test
