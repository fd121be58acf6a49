#include "flipfree/matchmaker/finish/settle.h"

#include <gtest/gtest.h>

#include "flipfree/matchmaker/smooth/relax.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::settle_test {
namespace {

TEST(Settle, LowersTheEnergyAndTheNumberOfVerticesAndHoldsWhatIsHeld) {
  ExecutionContext context;
  test::DrawnOutSquare square = test::drawn_out_square(context);
  std::vector<VertexId> held = square.map.surface.boundary;
  held.push_back(square.moved);
  const Points2 before = square.map.uv;
  const double energy = energy_of(square.map, context);
  const Index added = square.map.surface.mesh.vertex_count() - square.keep;
  ASSERT_GT(added, 20);
  settle(square.map, held, square.keep, context);
  test::expect_valid(square.map);
  EXPECT_LT(2 * (square.map.surface.mesh.vertex_count() - square.keep), added);
  EXPECT_LT(energy_of(square.map, context), energy);
  for (const VertexId v : held) EXPECT_EQ(square.map.uv.row(v), before.row(v));
  for (VertexId v = 0; v < square.keep; ++v)
    EXPECT_EQ(square.map.surface.support[static_cast<std::size_t>(v)].of(v), 1.0);
}

TEST(Settle, WithoutTimeLeavesAValidMap) {
  ExecutionContext context;
  test::DrawnOutSquare square = test::drawn_out_square(context);
  context.clock = [now = 0.0]() mutable { return now += 1.0; };
  const TimeLimit limit(context, 3.0);
  settle(square.map, square.map.surface.boundary, square.keep, context);
  test::expect_valid(square.map);
}

}  // namespace
}  // namespace flipfree::matchmaker::settle_test
