// The overlay of a metric that was only flipped, against straight segments in the plane.
#include "flipfree/intrinsic/overlay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "support/flipped_metrics.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::overlay_test {
namespace {

// A planar disk whose inner edges are mostly not Delaunay.
mesh::Surface sheared_grid() {
  mesh::Surface surface = test::grid(7, 6);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-0.03, 0.03);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double x = surface.vertices(v, 0), y = surface.vertices(v, 1);
    // The boundary stays straight: edges of the double cover then run in one copy or the other.
    const bool inside = x > 0.01 && x < 0.99 && y > 0.01 && y < 0.99;
    const double dx = inside ? uniform(random) : 0.0, dy = inside ? uniform(random) : 0.0;
    surface.vertices.row(v) << x + dx - 1.5 * (y + dy), y + dy, 0.0;
  }
  return surface;
}

// Every edge once.
std::vector<HalfedgeId> input_edges(const FlippedMetric& metric) {
  std::vector<HalfedgeId> curves;
  for (const HalfedgeId h : metric.input_halfedge) {
    if (h % 2 == 0) curves.push_back(h);
  }
  return curves;
}

TEST(Overlay, InputEdgesOfAMetricThatWasOnlyFlippedRunStraight) {
  const mesh::Surface surface = sheared_grid();
  const FlippedMetric metric = test::scaled_metric(
      surface, std::vector<double>(static_cast<std::size_t>(surface.vertices.rows()), 0.0));
  ASSERT_GT(metric.euclidean_flips, 10u);
  const Overlay overlay = build_overlay(metric, input_edges(metric), 1'000'000, ExecutionContext());
  const OverlayTrace& trace = overlay.trace;
  EXPECT_GT(overlay.straightened.moved, 10u);
  EXPECT_EQ(overlay.straightened.kept, 0u);
  const auto place = [&](VertexId v) {
    return Vector2(surface.vertices.row(metric.mesh.unknown[at(v)]).head<2>());
  };
  std::size_t inside = 0;
  for (std::size_t c = 0; c < trace.curves.size(); ++c) {
    const Vector2 a = place(metric.initial.origin_of(trace.curves[c]));
    const Vector2 b = place(metric.initial.target(trace.curves[c]));
    for (std::int64_t i = trace.begin[c]; i < trace.begin[c + 1]; ++i) {
      const auto id = static_cast<std::size_t>(i);
      const HalfedgeId h = trace.crossings[id].through;
      // Across the symmetry line the other copy lies elsewhere.
      if (metric.mesh.label_of_edge(h >> 1) == EdgeLabel::kPerpendicular ||
          metric.mesh.label_of_edge(h >> 1) == EdgeLabel::kDiagonal)
        continue;
      ++inside;
      const Between& on_edge = overlay.positions.on_edge[id];
      const Between& on_curve = overlay.positions.on_curve[id];
      const Vector2 by_edge = on_edge.source * place(metric.mesh.origin_of(h)) +
                              on_edge.target * place(metric.mesh.target(h));
      const Vector2 by_curve = on_curve.source * a + on_curve.target * b;
      EXPECT_LT((by_edge - by_curve).norm(), 1e-11);
    }
  }
  EXPECT_GT(inside, 10u);
}

TEST(Overlay, CrossesNothingWhereNothingWasFlipped) {
  const mesh::Surface surface = test::tetrahedron();
  const FlippedMetric metric = test::scaled_metric(surface, std::vector<double>(4, 0.0));
  ASSERT_TRUE(metric.flips.empty());
  const Overlay overlay = build_overlay(metric, input_edges(metric), 10, ExecutionContext());
  EXPECT_TRUE(overlay.trace.crossings.empty());
  for (const CurveStart& start : overlay.trace.start) EXPECT_TRUE(start.shared());
}

}  // namespace
}  // namespace flipfree::intrinsic::overlay_test
