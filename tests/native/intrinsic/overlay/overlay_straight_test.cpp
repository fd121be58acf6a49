// Straight lines over a plane triangulation against the plane itself.
#include "flipfree/intrinsic/overlay.h"

#include <gtest/gtest.h>

#include <cmath>

#include "intrinsic/layout/traced.h"

namespace flipfree::intrinsic::overlay_straight_test {
namespace {

std::vector<HalfedgeId> input_edges(const FlippedMetric& metric) {
  std::vector<HalfedgeId> curves;
  for (const HalfedgeId h : metric.input_halfedge) {
    if (h % 2 == 0) curves.push_back(h);
  }
  return curves;
}

OverlayCoordinates after_flips(const FlippedMetric& metric, std::size_t count) {
  OverlayCoordinates coordinates(metric.initial);
  replay_flips(metric.flips, 0, count, ExecutionContext(),
               [&](EdgeId e) { coordinates.flip(FlipMesh::halfedge(e)); });
  return coordinates;
}

bool leaves_the_copy(const FlippedMetric& metric, HalfedgeId h) {
  const EdgeLabel label = metric.mesh.label_of_edge(h >> 1);
  return label == EdgeLabel::kPerpendicular || label == EdgeLabel::kDiagonal;
}

TEST(FollowStraight, lines_cross_edges_where_they_do_in_the_plane) {
  const mesh::Surface surface = test::sheared_grid();
  const FlippedMetric metric = test::scaled_metric(
      surface, std::vector<double>(static_cast<std::size_t>(surface.vertices.rows()), 0.0));
  const OverlayCoordinates start = after_flips(metric, metric.euclidean_flips);
  const std::vector<HalfedgeId> curves = input_edges(metric);
  const StraightCurves lines =
      follow_straight(metric, start, curves, widened(metric.initial_length), ExecutionContext());
  ASSERT_EQ(lines.begin.size(), curves.size() + 1);
  const auto place = [&](VertexId v) {
    return Vector2(surface.vertices.row(metric.mesh.unknown[at(v)]).head<2>());
  };
  std::size_t inside = 0;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const Vector2 a = place(metric.initial.origin_of(curves[c]));
    const Vector2 b = place(metric.initial.target(curves[c]));
    double last = 0.0;
    for (const StraightCrossing& crossing : lines.of_curve(c)) {
      ASSERT_GT(crossing.on_edge.source, 0.0);
      EXPECT_GT(crossing.on_curve.target, last);
      last = crossing.on_curve.target;
      if (leaves_the_copy(metric, crossing.through)) continue;
      ++inside;
      const Vector2 on_edge =
          crossing.on_edge.source * place(start.current().origin_of(crossing.through)) +
          crossing.on_edge.target * place(start.current().origin_of(crossing.through ^ 1));
      EXPECT_LT((on_edge - (crossing.on_curve.source * a + crossing.on_curve.target * b)).norm(),
                1e-12);
    }
  }
  EXPECT_GT(inside, 10U);
}

struct Straight {
  OverlayTrace trace;
  StraightCurves lines;
  OverlayPositions before, after;
  Straightened result;
};

Straight straightened(const FlippedMetric& metric, const std::vector<long double>& initial_length) {
  const ExecutionContext context;
  const std::vector<HalfedgeId> curves = input_edges(metric);
  const OverlayCoordinates end = after_flips(metric, metric.flips.size());
  Straight s;
  s.trace = trace_overlay(end, curves, kMaxCrossings, context);
  std::vector<long double> scale;
  const std::vector<long double> u = widened(metric.u);
  for (const VertexId v : metric.mesh.unknown) scale.push_back(u[at(v)]);
  s.before = locate_crossings(end, s.trace, widened(metric.length), scale, context);
  s.lines = follow_straight(metric, after_flips(metric, metric.euclidean_flips), curves,
                            initial_length, context);
  s.after = s.before;
  s.result = straighten(metric, s.trace, s.lines, scale, s.after, context);
  return s;
}

std::vector<double> waves(const mesh::Surface& surface) {
  std::vector<double> u;
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v)
    u.push_back(2 * std::sin(7 * surface.vertices(v, 0)) +
                2 * std::cos(9 * surface.vertices(v, 1)));
  return u;
}

// Where a scaled metric's overlay crosses an edge that the Delaunay start has too, the place on the
// curve is the plane's, and that on the edge is the plane's rescaled by the factors of its ends.
TEST(Straighten, crossings_with_edges_of_the_start_lie_on_straight_lines) {
  const mesh::Surface surface = test::sheared_grid();
  const FlippedMetric metric = test::scaled_metric(surface, waves(surface));
  ASSERT_GT(metric.euclidean_flips, 10U);
  ASSERT_GT(metric.flips.size(), metric.euclidean_flips);
  const Straight s = straightened(metric, widened(metric.initial_length));
  EXPECT_GT(s.result.moved, 10U);
  EXPECT_GT(s.result.largest_move, 0.0);
  const auto u = to_doubles(metric.u);
  std::size_t checked = 0;
  for (std::size_t c = 0; c < s.trace.curves.size(); ++c) {
    double last = 0.0;
    for (auto i = static_cast<std::size_t>(s.trace.begin[c]);
         i < static_cast<std::size_t>(s.trace.begin[c + 1]); ++i) {
      EXPECT_GT(s.after.on_curve[i].target, last);
      last = s.after.on_curve[i].target;
      for (const StraightCrossing& line : s.lines.of_curve(c)) {
        // Moved there exactly.
        if (s.after.on_curve[i].target != line.on_curve.target ||
            line.through != s.trace.crossings[i].through)
          continue;
        ++checked;
        const VertexId from = metric.mesh.unknown[at(metric.mesh.origin_of(line.through))];
        const VertexId to = metric.mesh.unknown[at(metric.mesh.origin_of(line.through ^ 1))];
        const double ratio =
            line.on_edge.target / line.on_edge.source * std::exp(u[at(from)] - u[at(to)]);
        EXPECT_NEAR(s.after.on_edge[i].target / s.after.on_edge[i].source, ratio, 1e-9 * ratio);
      }
    }
    EXPECT_LT(last, 1.0);
  }
  EXPECT_GT(checked, 5U);
}

TEST(Straighten, lengths_that_flips_do_not_preserve_change_nothing) {
  const mesh::Surface surface = test::sheared_grid();
  const FlippedMetric metric = test::scaled_metric(surface, waves(surface));
  std::vector<long double> wrong = widened(metric.initial_length);
  for (std::size_t e = 0; e < wrong.size(); e += 3) wrong[e] *= 1.7L;
  const Straight s = straightened(metric, wrong);
  EXPECT_TRUE(s.lines.begin.empty());
  EXPECT_EQ(s.result.moved, 0U);
  for (std::size_t i = 0; i < s.before.on_edge.size(); ++i) {
    EXPECT_EQ(s.after.on_edge[i].target, s.before.on_edge[i].target);
    EXPECT_EQ(s.after.on_curve[i].target, s.before.on_curve[i].target);
  }
}

}  // namespace
}  // namespace flipfree::intrinsic::overlay_straight_test
