// Traced curves against chords of a convex polygon, which cross exactly where straight lines do.
#include "flipfree/intrinsic/overlay/overlay_trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "intrinsic/overlay/inscribed_polygon.h"

namespace flipfree::intrinsic::overlay_trace_test {
namespace {

constexpr Index kCorners = 20;

struct Chord {
  Index from, to;
};

// Share of the way along `a` at which it crosses `b`; -1 if they do not cross inside.
double crossing(const std::vector<Vector2>& points, const Chord& a, const Chord& b) {
  if (a.from == b.from || a.from == b.to || a.to == b.from || a.to == b.to) return -1.0;
  const Vector2 d = points[at(a.to)] - points[at(a.from)];
  const Vector2 e = points[at(b.to)] - points[at(b.from)];
  const Vector2 w = points[at(b.from)] - points[at(a.from)];
  const double whole = cross(d, e);
  const double along = cross(w, e) / whole, other = cross(w, d) / whole;
  return along > 0 && along < 1 && other > 0 && other < 1 ? along : -1.0;
}

// The half-edges of a mesh that join two corners of the polygon.
std::vector<HalfedgeId> chords(const FlipMesh& mesh) {
  std::vector<HalfedgeId> out;
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); h += 2) {
    if (mesh.origin_of(h) < kCorners && mesh.origin_of(h ^ 1) < kCorners) out.push_back(h);
  }
  return out;
}
Chord chord_of(const FlipMesh& mesh, HalfedgeId h) {
  return {mesh.origin_of(h), mesh.origin_of(h ^ 1)};
}

TEST(OverlayTrace, curves_cross_the_edges_that_chords_cross_in_their_order) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const test::InscribedPolygon polygon = test::inscribed_polygon(kCorners, seed);
    const FlipMesh& before = polygon.coordinates.input();
    const FlipMesh& after = polygon.coordinates.current();
    const std::vector<HalfedgeId> curves = chords(before);
    const OverlayTrace trace =
        trace_overlay(polygon.coordinates, curves, 1'000'000, ExecutionContext());
    ASSERT_EQ(trace.curves, curves);
    std::size_t crossings = 0;
    for (std::size_t c = 0; c < curves.size(); ++c) {
      const Chord curve = chord_of(before, curves[c]);
      std::vector<std::pair<double, EdgeId>> wanted;
      for (const HalfedgeId h : chords(after)) {
        const double along = crossing(polygon.points, curve, chord_of(after, h));
        if (along > 0.0) wanted.emplace_back(along, h >> 1);
      }
      std::sort(wanted.begin(), wanted.end());
      const auto found = trace.of_curve(c);
      ASSERT_EQ(found.size(), wanted.size()) << seed << " " << c;
      crossings += found.size();
      for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(found[i].through >> 1, wanted[i].second);
        // It leaves the face on the left of `through`: the start lies on that side.
        const Chord edge = chord_of(after, found[i].through);
        const Vector2 a = polygon.points[at(edge.from)], b = polygon.points[at(edge.to)];
        EXPECT_GT(cross(b - a, polygon.points[at(curve.from)] - a), 0.0);
      }
    }
    EXPECT_GT(crossings, 20U);
  }
}

TEST(OverlayTrace, positions_count_the_curves_along_an_edge) {
  const test::InscribedPolygon polygon = test::inscribed_polygon(kCorners, 3);
  const FlipMesh& before = polygon.coordinates.input();
  const FlipMesh& after = polygon.coordinates.current();
  const std::vector<HalfedgeId> curves = chords(before);
  const OverlayTrace trace =
      trace_overlay(polygon.coordinates, curves, 1'000'000, ExecutionContext());
  std::map<EdgeId, std::vector<std::pair<double, std::int64_t>>> along;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    for (const Crossing& crossed : trace.of_curve(c)) {
      const Chord edge = chord_of(after, crossed.through & ~1);
      along[crossed.through >> 1].emplace_back(
          crossing(polygon.points, edge, chord_of(before, curves[c])), crossed.position);
    }
  }
  std::size_t most = 0;
  for (auto& [edge, found] : along) {
    std::sort(found.begin(), found.end());
    most = std::max(most, found.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_EQ(found[i].second, static_cast<std::int64_t>(i));
    EXPECT_EQ(polygon.coordinates.crossings(2 * edge), static_cast<std::int64_t>(found.size()));
  }
  EXPECT_GT(most, 3U);
}

TEST(OverlayTrace, starts_say_in_which_corner_or_along_which_edge_a_curve_leaves) {
  const test::InscribedPolygon polygon = test::inscribed_polygon(kCorners, 5);
  const FlipMesh& before = polygon.coordinates.input();
  const FlipMesh& after = polygon.coordinates.current();
  const OverlayTrace trace = trace_overlay(polygon.coordinates, {}, 10, ExecutionContext());
  ASSERT_EQ(trace.start.size(), before.halfedge_count());
  for (HalfedgeId g = 0; at(g) < before.halfedge_count(); ++g) {
    if (before.origin_of(g) >= kCorners || before.origin_of(g ^ 1) >= kCorners) continue;
    const CurveStart& start = trace.start[at(g)];
    ASSERT_EQ(after.origin_of(start.halfedge), before.origin_of(g));
    if (start.shared()) {
      EXPECT_EQ(after.origin_of(start.halfedge ^ 1), before.origin_of(g ^ 1));
      continue;
    }
    const Vector2 v = polygon.points[at(before.origin_of(g))];
    const Vector2 towards = polygon.points[at(before.origin_of(g ^ 1))] - v;
    const Index right = after.origin_of(start.halfedge ^ 1);
    const Index left = after.origin_of(after.previous(start.halfedge));
    ASSERT_LT(std::max(left, right), kCorners);
    EXPECT_GT(cross(polygon.points[at(right)] - v, towards), 0.0);
    EXPECT_LT(cross(polygon.points[at(left)] - v, towards), 0.0);
  }
}

TEST(OverlayTrace, more_crossings_than_allowed_are_refused) {
  const test::InscribedPolygon polygon = test::inscribed_polygon(kCorners, 5);
  const std::vector<HalfedgeId> curves = chords(polygon.coordinates.input());
  const ExecutionContext context;
  const std::size_t all =
      trace_overlay(polygon.coordinates, curves, 1'000'000, context).crossings.size();
  EXPECT_EQ(trace_overlay(polygon.coordinates, curves, static_cast<std::int64_t>(all), context)
                .crossings.size(),
            all);
  EXPECT_THROW(
      (void)trace_overlay(polygon.coordinates, curves, static_cast<std::int64_t>(all) - 1, context),
      NotConverged);
}

}  // namespace
}  // namespace flipfree::intrinsic::overlay_trace_test
