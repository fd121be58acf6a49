#include "flipfree/distortion/minimize/minimize.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "support/shapes.h"

namespace flipfree::distortion::targets_test {
namespace {

using Targets = std::vector<std::pair<VertexId, Vector2>>;

Points2 plan(const mesh::Surface& surface) { return surface.vertices.leftCols<2>(); }

void expect_met(const mesh::Surface& surface, const Targets& targets,
                const MinimizeOptions& options = {}) {
  ExecutionContext context;
  Stats stats;
  const TargetsResult result =
      minimize_with_targets(surface, plan(surface), targets, options, context, stats);
  EXPECT_TRUE(is_flip_free(surface.faces, result.uv, context));
  EXPECT_EQ(result.fraction, 1.0);
  EXPECT_TRUE(result.missed.empty());
  for (const auto& [v, target] : targets) EXPECT_EQ(result.uv.row(v).transpose(), target);
  if (options.bijective) {
    const auto boundary = find_boundary(static_cast<Index>(result.uv.rows()), surface.faces);
    EXPECT_FALSE(overlaps_itself(boundary, result.uv, context));
  }
}

TEST(Targets, PinsAreMetBitForBit) {
  const mesh::Surface surface = test::bumpy_grid(30, 30, 0.2, 2);
  expect_met(surface, {{31 * 5 + 5, Vector2(0.1, 0.3)},
                       {31 * 15 + 15, Vector2(1.0 / 3.0, 0.7)},
                       {31 * 25 + 20, Vector2(0.9, 0.8)}});
}

TEST(Targets, APairOfPinsMayTurnTheMapAround) {
  const mesh::Surface surface = test::bumpy_grid(20, 20, 0.2, 2);
  expect_met(surface, {{21 * 10 + 2, Vector2(0.9, 0.5)}, {21 * 10 + 18, Vector2(0.1, 0.5)}});
}

TEST(Targets, BoundariesMayBeGivenAsAWhole) {
  const mesh::Surface surface = test::grid(20, 20);
  Targets targets;
  for (Index v = 0; v < 21 * 21; ++v) {
    const Index x = v % 21;
    const Index y = v / 21;
    if (x != 0 && y != 0 && x != 20 && y != 20) continue;
    // The square bent into half a ring.
    const double angle = 3.0 * x / 20.0;
    const double radius = 1.0 - 0.5 * y / 20.0;
    targets.emplace_back(v, Vector2(-radius * std::cos(angle), radius * std::sin(angle)));
  }
  // Orientation: y outwards must be on the left of x.
  for (auto& [v, target] : targets) target.y() = -target.y();
  expect_met(surface, targets);
}

TEST(Targets, BijectiveMapsStayOneToOneOnTheWay) {
  const mesh::Surface surface = test::grid(60, 4);
  MinimizeOptions options;
  options.bijective = true;
  // The ends of a strip are brought side by side: it bends into a hairpin.
  expect_met(surface, {{2 * 61, Vector2(0.2, 0.0)}, {2 * 61 + 60, Vector2(0.2, 0.9)}}, options);
}

TEST(Targets, UnreachableOnesAreNamedAndTheMapIsStillValid) {
  const mesh::Surface surface = test::grid(10, 10);
  // A triangle's corners in the wrong order.
  const Targets targets = {
      {60, Vector2(0.5, 0.5)}, {61, Vector2(0.5, 0.6)}, {72, Vector2(0.6, 0.5)}};
  ExecutionContext context;
  Stats stats;
  const TargetsResult result =
      minimize_with_targets(surface, plan(surface), targets, {}, context, stats);
  EXPECT_TRUE(is_flip_free(surface.faces, result.uv, context));
  EXPECT_LT(result.fraction, 1.0);
  EXPECT_FALSE(result.missed.empty());
}

TEST(Targets, BadTargetsAreRefused) {
  const mesh::Surface surface = test::grid(4, 4);
  ExecutionContext context;
  Stats stats;
  const auto solve = [&](const Targets& targets) {
    minimize_with_targets(surface, plan(surface), targets, {}, context, stats);
  };
  EXPECT_THROW(solve({{3, Vector2(0, 0)}, {3, Vector2(1, 0)}}), InvalidInput);
  EXPECT_THROW(solve({{99, Vector2(0, 0)}}), InvalidInput);
  EXPECT_THROW(solve({{3, Vector2(std::nan(""), 0)}}), InvalidInput);
}

}  // namespace
}  // namespace flipfree::distortion::targets_test
