#include "flipfree/matchmaker/at_once/arms.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/continuation/continuation.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::arms_test {
namespace {

constexpr Index kSide = 24;

// Twelve vertices of a grid change places.
Constraints exchange(const mesh::RefinedMap& map) {
  Constraints constraints;
  const auto vertex = [](Index k) { return (kSide + 1) * (4 + 5 * (k / 3)) + 5 + 7 * (k % 3); };
  for (Index i = 0; i < 12; ++i) {
    constraints.pins.push_back(
        {vertex(i), map.uv.row(vertex((5 * i + 3) % 12)).transpose() + Vector2(0.0123, 0.0077)});
  }
  return constraints;
}

TEST(Arms, PinsThatChangePlacesArriveAllAtOnceForFewAddedVertices) {
  const mesh::Surface surface = test::bumpy_grid(kSide, kSide, 0.05, 7.0);
  mesh::RefinedMap map = test::identity_map(surface);
  const Constraints constraints = exchange(map);
  ExecutionContext context;
  Stats stats;
  ASSERT_EQ(move_pins(map, constraints, false, true, context, stats), Arrival::kArms);
  test::expect_valid(map);
  for (const PinnedVertex& p : constraints.pins)
    EXPECT_EQ(Vector2(map.uv.row(p.vertex).transpose()), p.uv);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  EXPECT_LT(map.surface.mesh.vertex_count(), keep + keep / 5);
  EXPECT_GT(std::get<std::int64_t>(stats["arms.lifted"]), 2 * keep);
}

TEST(Arms, AreTheSameBitsForAnyNumberOfThreads) {
  const mesh::Surface surface = test::grid(kSide, kSide);
  Points2 first;
  for (const int threads : {1, 2, 3}) {
    mesh::RefinedMap map = test::identity_map(surface);
    ExecutionContext context;
    context.threads = threads;
    Stats stats;
    ASSERT_TRUE(move_with_arms(map, exchange(map), context, stats));
    if (threads == 1) first = map.uv;
    EXPECT_EQ(map.uv, first);
  }
}

TEST(Arms, DoNotDependOnWhereTheMapWasBefore) {
  const mesh::Surface surface = test::grid(12, 12);
  Constraints constraints;
  constraints.pins = {{50, {0.9, 0.8}}, {60, {0.1, 0.3}}, {110, {0.2, 0.9}}};
  mesh::RefinedMap here = test::identity_map(surface);
  mesh::RefinedMap there = here;
  there.uv *= 3;
  ExecutionContext context;
  Stats stats;
  ASSERT_TRUE(move_with_arms(here, constraints, context, stats));
  ASSERT_TRUE(move_with_arms(there, constraints, context, stats));
  EXPECT_EQ(here.uv, there.uv);
}

TEST(Arms, WhatTheyAreNotForIsLeftAsItIs) {
  const mesh::Surface surface = test::grid(kSide, kSide);
  mesh::RefinedMap map = test::identity_map(surface);
  const Points2 before = map.uv;
  ExecutionContext context;
  Stats stats;
  Constraints one_to_one = exchange(map);
  one_to_one.one_to_one = true;
  Constraints with_line = exchange(map);
  with_line.edges.emplace_back(0, 1);
  Constraints with_outline = exchange(map);
  for (const VertexId v : map.surface.boundary)
    with_outline.outline.push_back(map.uv.row(v).transpose());
  Constraints two = exchange(map);
  two.pins.resize(2);
  for (const Constraints& constraints : {one_to_one, with_line, with_outline, two}) {
    EXPECT_FALSE(move_with_arms(map, constraints, context, stats));
    EXPECT_EQ(map.uv, before);
  }
}

TEST(Arms, CanBeCancelled) {
  const mesh::Surface surface = test::grid(kSide, kSide);
  mesh::RefinedMap map = test::identity_map(surface);
  const Points2 before = map.uv;
  ExecutionContext context;
  context.cancel();
  Stats stats;
  EXPECT_THROW(move_with_arms(map, exchange(map), context, stats), Cancelled);
  EXPECT_EQ(map.uv, before);
}

}  // namespace
}  // namespace flipfree::matchmaker::arms_test
