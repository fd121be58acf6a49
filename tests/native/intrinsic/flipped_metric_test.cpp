#include "flipfree/intrinsic/flipped_metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "support/flipped_metrics.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::flipped_metric_test {
namespace {

FlippedMetric some_metric() {
  const mesh::Surface surface = test::torus(9, 7);
  std::vector<double> u(static_cast<std::size_t>(surface.vertices.rows()), 0.0);
  for (std::size_t v = 0; v < u.size(); ++v) u[v] = std::sin(2.3 * static_cast<double>(v));
  return test::scaled_metric(surface, u);
}

TEST(FlippedMetric, OfFlipsAndScalesHoldsTogether) {
  const FlippedMetric metric = some_metric();
  ASSERT_GT(metric.flips.size(), metric.euclidean_flips);
  EXPECT_EQ(find_broken_invariant(metric), "");
}

TEST(FlippedMetric, WhateverIsBrokenIsFound) {
  const FlippedMetric good = some_metric();
  const auto broken = [&](const auto& change) {
    FlippedMetric metric = good;
    change(metric);
    return find_broken_invariant(metric);
  };
  EXPECT_NE(broken([](FlippedMetric& m) { m.flips.pop_back(); }), "");
  EXPECT_NE(broken([](FlippedMetric& m) { m.euclidean_flips = m.flips.size() + 1; }), "");
  EXPECT_NE(broken([](FlippedMetric& m) { std::get<0>(m.length).pop_back(); }), "");
  EXPECT_NE(broken([](FlippedMetric& m) { std::get<0>(m.length)[3] = 0.0; }), "");
  EXPECT_NE(broken([](FlippedMetric& m) { std::get<0>(m.initial_length)[3] = -1.0; }), "");
  EXPECT_NE(broken([](FlippedMetric& m) { std::get<0>(m.u).push_back(0.0); }), "");
  EXPECT_NE(broken([](FlippedMetric& m) { std::swap(m.input_halfedge[0], m.input_halfedge[1]); }),
            "");
  EXPECT_NE(broken([](FlippedMetric& m) { m.mesh.next[0] = m.mesh.next[1]; }), "");
}

TEST(FlippedMetric, FlipsAreReplayedInOrderAndInPart) {
  const FlippedMetric metric = some_metric();
  const ExecutionContext context;
  std::vector<EdgeId> all, parts;
  replay_flips(metric.flips, 0, metric.flips.size(), context, [&](EdgeId e) { all.push_back(e); });
  const std::size_t half = metric.flips.size() / 2;
  replay_flips(metric.flips, 0, half, context, [&](EdgeId e) { parts.push_back(e); });
  replay_flips(metric.flips, half, metric.flips.size(), context,
               [&](EdgeId e) { parts.push_back(e); });
  EXPECT_EQ(parts, all);
  EXPECT_GE(all.size(), metric.flips.size());
}

}  // namespace
}  // namespace flipfree::intrinsic::flipped_metric_test
