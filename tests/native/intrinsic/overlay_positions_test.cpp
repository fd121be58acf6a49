// Positions of crossings against chords of one circle, where Penner lengths are Euclidean lengths
// and hyperbolic lines are straight.
#include "flipfree/intrinsic/overlay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "support/flip_meshes.h"

namespace flipfree::intrinsic::overlay_positions_test {
namespace {

// A fan over n points of the unit circle, closed by an apex; edges of the disk may be flipped.
struct InscribedPolygon {
  std::vector<Vector2> points;
  OverlayCoordinates coordinates;
  Index apex;
};

InscribedPolygon inscribed_polygon(Index n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> jitter(-0.4, 0.4);
  std::vector<Vector2> points;
  mesh::Surface fan;
  fan.vertices.resize(n, 3);
  Triangles faces(n - 2, 3);
  for (Index i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * (i + jitter(random)) / n;
    points.emplace_back(std::cos(a), std::sin(a));
    fan.vertices.row(i) << points.back().x(), points.back().y(), 0.0;
  }
  for (Index i = 0; i + 2 < n; ++i) faces.row(i) << 0, i + 1, i + 2;
  fan.faces = std::move(faces);
  OverlayCoordinates coordinates(test::closed_mesh(fan));
  for (int k = 0; k < 60 * n; ++k) {
    const auto h = static_cast<HalfedgeId>(
        random() % static_cast<unsigned>(coordinates.current().halfedge_count()));
    const FlipMesh& mesh = coordinates.current();
    const auto touches = [&](HalfedgeId g) {
      return mesh.origin_of(g) == n || mesh.origin_of(g ^ 1) == n ||
             mesh.origin_of(mesh.previous(g)) == n || mesh.origin_of(mesh.previous(g ^ 1)) == n;
    };
    if (!touches(h)) coordinates.flip(h);
  }
  return {points, std::move(coordinates), n};
}

TEST(OverlayPositions, ChordsOfOneCircleCrossWhereTheyCross) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Index n = 24;
    const InscribedPolygon polygon = inscribed_polygon(n, seed);
    const FlipMesh& mesh = polygon.coordinates.current();
    std::mt19937 random(seed + 100);
    std::uniform_real_distribution<double> scale_of(-3.0, 3.0);
    std::vector<long double> u(at(n) + 1);
    for (auto& x : u) x = scale_of(random);
    std::vector<long double> lengths(mesh.edge_count(), 1.0L);
    for (EdgeId e = 0; at(e) < mesh.edge_count(); ++e) {
      const Index a = mesh.origin_of(2 * e), b = mesh.origin_of(2 * e + 1);
      if (a < n && b < n) {
        lengths[at(e)] =
            static_cast<long double>((polygon.points[at(a)] - polygon.points[at(b)]).norm()) *
            std::exp((u[at(a)] + u[at(b)]) / 2);
      }
    }
    std::vector<HalfedgeId> curves;
    for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); h += 2) {
      if (polygon.coordinates.input().origin_of(h) < n &&
          polygon.coordinates.input().origin_of(h ^ 1) < n) {
        curves.push_back(h);
      }
    }
    const ExecutionContext context;
    const OverlayTrace trace = trace_overlay(polygon.coordinates, curves, 1'000'000, context);
    const OverlayPositions positions =
        locate_crossings(polygon.coordinates, trace, lengths, u, context);
    ASSERT_GT(trace.crossings.size(), 20u);
    for (std::size_t c = 0; c < curves.size(); ++c) {
      const Vector2 a = polygon.points[at(polygon.coordinates.input().origin_of(curves[c]))];
      const Vector2 d =
          polygon.points[at(polygon.coordinates.input().origin_of(curves[c] ^ 1))] - a;
      for (std::int64_t i = trace.begin[c]; i < trace.begin[c + 1]; ++i) {
        const auto id = static_cast<std::size_t>(i);
        const HalfedgeId h = trace.crossings[id].through;
        const Index s = mesh.origin_of(h), t = mesh.origin_of(h ^ 1);
        const Vector2 p = polygon.points[at(s)], e = polygon.points[at(t)] - p;
        const double cross = d.x() * e.y() - d.y() * e.x();
        const double along_curve = ((p - a).x() * e.y() - (p - a).y() * e.x()) / cross;
        const double along_edge = ((p - a).x() * d.y() - (p - a).y() * d.x()) / cross;
        // The input's metric is the circle's; the final one weights end points by exp(-u).
        EXPECT_NEAR(positions.on_curve[id].target, along_curve, 1e-12);
        const double ws = (1 - along_edge) * std::exp(static_cast<double>(-u[at(s)]));
        const double wt = along_edge * std::exp(static_cast<double>(-u[at(t)]));
        EXPECT_NEAR(positions.on_edge[id].target, wt / (ws + wt), 1e-12);
        EXPECT_NEAR(positions.on_edge[id].source + positions.on_edge[id].target, 1.0, 1e-15);
      }
    }
  }
}

}  // namespace
}  // namespace flipfree::intrinsic::overlay_positions_test
