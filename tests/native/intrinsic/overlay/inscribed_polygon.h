// Triangulations of a convex polygon under random flips: their edges are chords, which cross where
// straight lines do.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "flipfree/intrinsic/overlay.h"
#include "support/flip_meshes.h"

namespace flipfree::test {

// A fan over n points of the unit circle, closed by an apex; edges of the disk may be flipped.
struct InscribedPolygon {
  std::vector<Vector2> points;
  intrinsic::OverlayCoordinates coordinates;
  Index apex;
};

inline InscribedPolygon inscribed_polygon(Index n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> jitter(-0.4, 0.4);
  std::vector<Vector2> points;
  mesh::Surface fan;
  fan.vertices.resize(n, 3);
  fan.faces.resize(n - 2, 3);
  for (Index i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * (i + jitter(random)) / n;
    points.emplace_back(std::cos(a), std::sin(a));
    fan.vertices.row(i) << points.back().x(), points.back().y(), 0.0;
  }
  for (Index i = 0; i + 2 < n; ++i) fan.faces.row(i) << 0, i + 1, i + 2;
  intrinsic::OverlayCoordinates coordinates(closed_mesh(fan));
  for (int k = 0; k < 60 * n; ++k) {
    const auto h = static_cast<HalfedgeId>(
        random() % static_cast<unsigned>(coordinates.current().halfedge_count()));
    const intrinsic::FlipMesh& mesh = coordinates.current();
    const auto touches = [&](HalfedgeId g) {
      return mesh.origin_of(g) == n || mesh.origin_of(g ^ 1) == n ||
             mesh.origin_of(mesh.previous(g)) == n || mesh.origin_of(mesh.previous(g ^ 1)) == n;
    };
    if (!touches(h)) coordinates.flip(h);
  }
  return {points, std::move(coordinates), n};
}

}  // namespace flipfree::test
