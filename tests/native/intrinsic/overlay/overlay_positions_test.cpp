// Positions of crossings against chords of one circle (where Penner lengths are Euclidean lengths
// and hyperbolic lines are straight), and against the two-triangle chart of thesis 4.5.
#include "flipfree/intrinsic/overlay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "intrinsic/overlay/inscribed_polygon.h"
#include "support/flip_meshes.h"

namespace flipfree::intrinsic::overlay_positions_test {
namespace {

TEST(OverlayPositions, ChordsOfOneCircleCrossWhereTheyCross) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Index n = 24;
    const test::InscribedPolygon polygon = test::inscribed_polygon(n, seed);
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

// Thesis 4.5: scaled so that one diagonal is (-p, p) and the other (-p^r, p^r), both diagonals are
// diameters of the chart's circle and cross in its centre; the circumcircle-preserving map weights
// corner i by S_i = l_ij l_ki m_jk / (m_ij m_ki l_jk), from source lengths l to target lengths m.
TEST(OverlayPositions, OneFlipAgreesWithTheTwoTriangleChart) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> length_of(0.5, 2.0);
  mesh::Surface quad;
  quad.vertices.resize(4, 3);
  quad.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
  quad.faces.resize(2, 3);
  quad.faces << 0, 1, 2, 0, 2, 3;
  for (int round = 0; round < 20; ++round) {
    OverlayCoordinates coordinates(test::closed_mesh(quad));
    HalfedgeId diagonal = kInvalid;
    for (HalfedgeId h = 0; at(h) < coordinates.current().halfedge_count(); ++h) {
      if (coordinates.current().origin_of(h) == 0 && coordinates.current().origin_of(h ^ 1) == 2)
        diagonal = h;
    }
    // Lengths i = 0, j = 2, k = 3 (left of 0 -> 2), l = 1.
    const double ij = length_of(random), jk = length_of(random), ki = length_of(random),
                 il = length_of(random), lj = length_of(random);
    coordinates.flip(diagonal);
    const FlipMesh& mesh = coordinates.current();
    std::vector<long double> lengths(mesh.edge_count(), 1.0L);
    const auto set = [&](Index a, Index b, double length) {
      for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
        if (mesh.origin_of(h) == a && mesh.origin_of(h ^ 1) == b) lengths[at(h >> 1)] = length;
      }
    };
    const double kl = (jk * il + ki * lj) / ij;
    set(2, 3, jk), set(3, 0, ki), set(0, 1, il), set(1, 2, lj), set(1, 3, kl);
    const ExecutionContext context;
    const OverlayTrace trace = trace_overlay(coordinates, {diagonal}, 10, context);
    ASSERT_EQ(trace.crossings.size(), 1u);
    const OverlayPositions positions =
        locate_crossings(coordinates, trace, lengths, std::vector<long double>(5, 0.0L), context);

    const double cross_ratio = (jk * il) / (lj * ki);
    const double r = (1 - cross_ratio) / (1 + cross_ratio);
    // Chart: i = -p, j = p, k and l at -+(r, sqrt(1 - r^2)); which sign of r goes with k follows
    // from |ki| / |jk|.
    const Vector2 p(1, 0);
    for (const double sign : {1.0, -1.0}) {
      const Vector2 k(sign * r, std::sqrt(1 - r * r)), l = -k;
      const double chart_jk = (k - p).norm(), chart_ki = (k + p).norm(), chart_il = (l + p).norm(),
                   chart_lj = (l - p).norm();
      if (std::abs(chart_jk * chart_il / (chart_lj * chart_ki) - cross_ratio) > 1e-9) continue;
      const auto weight = [](double ab, double ca, double bc, double ab2, double ca2, double bc2) {
        return ab * ca * bc2 / (ab2 * ca2 * bc);
      };
      const double si = weight(2, chart_ki, chart_jk, ij, ki, jk);
      const double sj = weight(chart_jk, 2, chart_ki, jk, ij, ki);
      EXPECT_NEAR(positions.on_curve[0].target, sj / (si + sj), 1e-12);
    }
  }
}

TEST(OverlayPositions, HugeScaleRangesKeepRelativePrecision) {
  const Index n = 24;
  const test::InscribedPolygon polygon = test::inscribed_polygon(n, 1);
  const FlipMesh& mesh = polygon.coordinates.current();
  std::vector<long double> u(at(n) + 1, 0.0L), lengths(mesh.edge_count(), 1.0L);
  for (Index v = 0; v < n; ++v) u[at(v)] = 120.0L * v;  // 10^1200 altogether
  for (EdgeId e = 0; at(e) < mesh.edge_count(); ++e) {
    const Index a = mesh.origin_of(2 * e), b = mesh.origin_of(2 * e + 1);
    if (a < n && b < n) {
      lengths[at(e)] =
          static_cast<long double>((polygon.points[at(a)] - polygon.points[at(b)]).norm()) *
          std::exp((u[at(a)] + u[at(b)]) / 2);
    }
  }
  const ExecutionContext context;
  std::vector<HalfedgeId> curves;
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); h += 2) {
    if (std::max(polygon.coordinates.input().origin_of(h),
                 polygon.coordinates.input().origin_of(h ^ 1)) < n) {
      curves.push_back(h);
    }
  }
  const OverlayTrace trace = trace_overlay(polygon.coordinates, curves, 1'000'000, context);
  const OverlayPositions scaled = locate_crossings(polygon.coordinates, trace, lengths, u, context);
  for (EdgeId e = 0; at(e) < mesh.edge_count(); ++e) {
    const Index a = mesh.origin_of(2 * e), b = mesh.origin_of(2 * e + 1);
    if (a < n && b < n) lengths[at(e)] *= std::exp(-(u[at(a)] + u[at(b)]) / 2);
  }
  std::fill(u.begin(), u.end(), 0.0L);
  const OverlayPositions plain = locate_crossings(polygon.coordinates, trace, lengths, u, context);
  for (std::size_t i = 0; i < trace.crossings.size(); ++i) {
    EXPECT_NEAR(scaled.on_curve[i].target / plain.on_curve[i].target, 1.0, 1e-11);
    EXPECT_NEAR(scaled.on_curve[i].source / plain.on_curve[i].source, 1.0, 1e-11);
  }
}

}  // namespace
}  // namespace flipfree::intrinsic::overlay_positions_test
