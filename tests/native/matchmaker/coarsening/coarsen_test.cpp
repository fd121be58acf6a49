#include "flipfree/matchmaker/coarsening/coarsen.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::coarsen_test {
namespace {

TEST(Coarsen, LeavesNoVertexThatNothingNeedsAndKeepsThePins) {
  const mesh::Surface surface = test::grid(20, 20);
  const VertexId v = 21 * 10 + 4;
  const auto keep = static_cast<Index>(surface.vertices.rows());
  for (const Coarsening how : {Coarsening::kAll, Coarsening::kBounded}) {
    ExecutionContext context;
    Stats stats;
    const mesh::RefinedMap map = test::drawn_out(surface, v, context);
    Constraints constraints;
    constraints.pins = {{v, map.uv.row(v).transpose()}};
    const mesh::RefinedMap coarse = coarsen(map, constraints, keep, context, stats, how);
    test::expect_valid(coarse);
    EXPECT_LE(coarse.surface.mesh.vertex_count(), map.surface.mesh.vertex_count());
    if (how == Coarsening::kAll) {
      EXPECT_LT(coarse.surface.mesh.vertex_count(), map.surface.mesh.vertex_count());
    }
    EXPECT_EQ(coarse.uv.row(v), map.uv.row(v));
    EXPECT_EQ(std::get<std::int64_t>(stats.at("coarsen.removed")),
              map.surface.mesh.vertex_count() - coarse.surface.mesh.vertex_count());
  }
}

TEST(Coarsen, OutOfTimeItEndsWithWhatItHas) {
  const mesh::Surface surface = test::grid(20, 20);
  const VertexId v = 21 * 10 + 4;
  ExecutionContext context;
  const mesh::RefinedMap map = test::drawn_out(surface, v, context);
  Constraints constraints;
  constraints.pins = {{v, map.uv.row(v).transpose()}};
  context.clock = [now = 0.0]() mutable { return now += 1.0; };
  const TimeLimit limit(context, 5);
  Stats stats;
  const mesh::RefinedMap coarse =
      coarsen(map, constraints, static_cast<Index>(surface.vertices.rows()), context, stats);
  EXPECT_EQ(std::get<std::int64_t>(stats.at("time_limit_reached")), 1);
  test::expect_valid(coarse);
  EXPECT_EQ(coarse.uv.row(v), map.uv.row(v));
}

}  // namespace
}  // namespace flipfree::matchmaker::coarsen_test
