// Loops that turn, exchanged for loops that do not.
#include "flipfree/seamless/padding/straight/straight_loops.h"

#include <cmath>
#include <limits>

#include "flipfree/seamless/padding/topology/hole_chain.h"
#include "flipfree/seamless/padding/topology/holes.h"
#include "flipfree/seamless/padding/topology/short_loops.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::straight_loops_test {
namespace {

std::vector<Index> many_cones(const mesh::Surface& surface, Index genus, unsigned seed) {
  std::vector<Index> cones(static_cast<std::size_t>(8 * genus - 8 + 8), 5);
  cones.insert(cones.end(), 8, 3);
  return test::scattered(surface, cones, seed);
}

TEST(StraightLoops, ACycleCrossesItsLoopOnceAndIsStraight) {
  const Index genus = 3;
  const mesh::Surface surface = test::of_genus(genus, 3);
  const std::vector<Index> cones = many_cones(surface, genus, 4);
  ExecutionContext context;
  const std::vector<double> crossings = flat_crossings(surface, cones, context);
  Canvas canvas(surface, cones);
  const TurnMeter meter(canvas, crossings);
  const auto loops = draw_short_loops(canvas, genus, {}, nullptr, context);
  const Holes holes(canvas, loops);
  for (std::size_t l = 0; l < loops.size(); ++l) {
    const std::vector<VertexId> cycle =
        crossing_cycle(meter, loops[l], {1.0}, std::numeric_limits<double>::infinity(), context);
    ASSERT_GT(cycle.size(), 2u);
    EXPECT_LT(std::abs(meter.turn(cycle)), 0.5 * TurnMeter::kQuarter);
    EXPECT_EQ(std::set<VertexId>(cycle.begin(), cycle.end()).size(), cycle.size());
    EXPECT_EQ(holes.loop_of(cycle.front()), static_cast<Index>(l));
    for (std::size_t i = 1; i < cycle.size(); ++i) EXPECT_TRUE(canvas.is_free(cycle[i]));
    const HalfedgeId out = canvas.mesh().find(cycle.front(), cycle[1]);
    const HalfedgeId in = canvas.mesh().find(cycle.front(), cycle.back());
    EXPECT_EQ(holes.hole_of(canvas.sector_of(out)), static_cast<Index>(2 * l));
    EXPECT_EQ(holes.hole_of(canvas.sector_of(in)), static_cast<Index>(2 * l + 1));
    // Nothing for less than it costs.
    const double cost = loop_cost(meter, cycle, {1.0});
    EXPECT_TRUE(crossing_cycle(meter, loops[l], {1.0}, cost * (1.0 - 1e-9), context).empty());
  }
}

TEST(StraightLoops, AreAsManyDisjointAndOpenAllHandles) {
  Index exchanged = 0;
  for (const Index genus : {2, 4, 6}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 2);
      const std::vector<Index> cones = many_cones(surface, genus, seed);
      ExecutionContext context;
      const std::vector<double> crossings = flat_crossings(surface, cones, context);
      Canvas canvas(surface, cones);
      const TurnMeter meter(canvas, crossings);
      auto loops = draw_short_loops(canvas, genus, {}, nullptr, context);
      const auto before = loops;
      const TurningPrice price{20.0};
      straighten_loops(canvas, meter, price, loops, context);
      ASSERT_EQ(loops.size(), before.size());
      std::set<VertexId> taken;
      std::size_t vertices = 0;
      for (std::size_t l = 0; l < loops.size(); ++l) {
        taken.insert(loops[l].begin(), loops[l].end());
        vertices += loops[l].size();
        if (loops[l] == before[l]) continue;
        ++exchanged;
        EXPECT_LT(std::abs(meter.turn(loops[l])), 0.5 * TurnMeter::kQuarter);
      }
      EXPECT_EQ(taken.size(), vertices);
      for (VertexId v = 0; v < canvas.vertex_count(); ++v)
        EXPECT_EQ(canvas.on_curve(v), taken.contains(v));
      // A chain of their holes leaves one disk.
      const Holes holes(canvas, loops);
      draw_connectors(canvas, holes,
                      hole_order(holes.count(), hole_neighbours(canvas, holes, context), genus > 2),
                      nullptr, context);
      EXPECT_EQ(disk_boundary(canvas).corners_below.back(), 8 * genus - 4);
    }
  }
  EXPECT_GE(exchanged, 5);
}

}  // namespace
}  // namespace flipfree::seamless::straight_loops_test
