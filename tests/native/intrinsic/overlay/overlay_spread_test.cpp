#include "flipfree/intrinsic/overlay/overlay_spread.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "flipfree/intrinsic/overlay/overlay.h"
#include "intrinsic/layout/traced.h"

namespace flipfree::intrinsic::overlay_spread_test {
namespace {

Overlay sheared_overlay() {
  const mesh::Surface surface = test::sheared_grid();
  const FlippedMetric metric = test::scaled_metric(
      surface, std::vector<double>(static_cast<std::size_t>(surface.vertices.rows()), 0.0));
  std::vector<HalfedgeId> curves;
  for (const HalfedgeId h : metric.input_halfedge) {
    if (h % 2 == 0) curves.push_back(h);
  }
  return build_overlay(metric, curves, 1'000'000, ExecutionContext());
}

// Per edge of T, along its even half-edge: places in the order that is known exactly.
std::map<EdgeId, std::vector<double>> places_on_edges(const OverlayTrace& trace,
                                                      const OverlayPositions& positions) {
  std::map<EdgeId, std::map<std::int64_t, double>> sorted;
  for (std::size_t i = 0; i < trace.crossings.size(); ++i) {
    const Crossing& crossing = trace.crossings[i];
    const Between& b = positions.on_edge[i];
    sorted[crossing.through >> 1][crossing.position] =
        (crossing.through & 1) == 0 ? b.target : b.source;
  }
  std::map<EdgeId, std::vector<double>> result;
  for (const auto& [e, by_position] : sorted) {
    for (const auto& [position, place] : by_position) result[e].push_back(place);
  }
  return result;
}

void expect_apart(const std::vector<double>& places, double share) {
  const double gap = 0.999 * share / static_cast<double>(places.size() + 1);
  double last = 0.0;
  for (const double place : places) {
    EXPECT_GE(place - last, gap);
    last = place;
  }
  EXPECT_GE(1.0 - last, gap);
}

std::vector<double> places_on_curve(const Overlay& overlay, std::size_t c) {
  std::vector<double> places;
  for (auto i = static_cast<std::size_t>(overlay.trace.begin[c]);
       i < static_cast<std::size_t>(overlay.trace.begin[c + 1]); ++i) {
    places.push_back(overlay.positions.on_curve[i].target);
  }
  return places;
}

TEST(SpreadCrossings, KeepsTheirOrderAndSetsThemApart) {
  Overlay overlay = sheared_overlay();
  ASSERT_GT(overlay.trace.crossings.size(), 20U);
  spread_crossings(overlay.trace, 0.25, overlay.positions);
  for (const auto& [e, places] : places_on_edges(overlay.trace, overlay.positions))
    expect_apart(places, 0.25);
  for (std::size_t c = 0; c < overlay.trace.curves.size(); ++c)
    expect_apart(places_on_curve(overlay, c), 0.25);
  for (const auto* all : {&overlay.positions.on_edge, &overlay.positions.on_curve}) {
    for (const Between& b : *all) EXPECT_NEAR(b.source + b.target, 1.0, 1e-15);
  }
}

TEST(SpreadCrossings, OpensWhatRoundingPressedTogetherOrPutOutOfOrder) {
  Overlay overlay = sheared_overlay();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(-1e-16, 1e-16);
  for (auto* all : {&overlay.positions.on_edge, &overlay.positions.on_curve}) {
    for (Between& b : *all) {
      b.target = 0.75 + noise(random);
      b.source = 1.0 - b.target;
    }
  }
  spread_crossings(overlay.trace, 0.5, overlay.positions);
  std::size_t most = 0;
  for (const auto& [e, places] : places_on_edges(overlay.trace, overlay.positions)) {
    most = std::max(most, places.size());
    for (std::size_t i = 1; i < places.size(); ++i)
      EXPECT_GE(places[i] - places[i - 1], 0.4 / static_cast<double>(places.size() + 1));
  }
  EXPECT_GT(most, 1U);
}

TEST(SpreadCrossings, ByNothingLeavesThemWhereTheyWere) {
  Overlay overlay = sheared_overlay();
  const OverlayPositions before = overlay.positions;
  spread_crossings(overlay.trace, 0.0, overlay.positions);
  for (std::size_t i = 0; i < before.on_edge.size(); ++i) {
    EXPECT_NEAR(overlay.positions.on_edge[i].target, before.on_edge[i].target, 1e-15);
    EXPECT_NEAR(overlay.positions.on_curve[i].target, before.on_curve[i].target, 1e-15);
  }
}

}  // namespace
}  // namespace flipfree::intrinsic::overlay_spread_test
