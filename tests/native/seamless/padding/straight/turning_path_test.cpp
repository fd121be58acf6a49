// Paths that are judged by how much they turn.
#include "flipfree/seamless/padding/straight/turning_path.h"

#include <cmath>
#include <limits>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/paths/free_path.h"
#include "flipfree/seamless/padding/topology/holes.h"
#include "flipfree/seamless/padding/topology/short_loops.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::turning_path_test {
namespace {

struct Found {
  std::vector<HalfedgeId> path;
  double turned = 0.0, length = 0.0;
};

double length_of(const Canvas& canvas, const std::vector<HalfedgeId>& path) {
  double length = 0.0;
  for (const HalfedgeId h : path) length += canvas.length(h);
  return length;
}

double turn_of(const TurnMeter& meter, const std::vector<HalfedgeId>& path) {
  double turn = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) turn += meter.turn(path[i - 1], path[i]);
  return turn;
}

// The cheapest path from one hole to another one that turns by nothing.
Found cheapest(const TurnMeter& meter, const Holes& holes, Index from, Index to,
               const TurningPrice& price) {
  TurningSearch search(meter);
  const Canvas& canvas = meter.canvas();
  for (const HalfedgeId sector : holes.open_sectors(from))
    canvas.for_each_inside(sector, [&](HalfedgeId h) { search.start(h, 0.0); });
  double least = std::numeric_limits<double>::infinity();
  Found found;
  ExecutionContext context;
  search.run(
      [&](const TurningSearch::Arrival& arrival) {
        const HalfedgeId back = canvas.mesh().opposite(arrival.halfedge);
        if (!holes.has(to, canvas.sector_of(back))) return;
        const double cost = price.cost(arrival.length, arrival.turned);
        if (cost >= least) return;
        least = cost;
        found = {search.path(arrival), arrival.turned, arrival.length};
        EXPECT_EQ(found.path.front(), arrival.first);
      },
      [&] { return least; }, nullptr, context);
  return found;
}

TEST(TurningPath, IsTheShortestOneWhereTurnsAreFreeAndTurnsLessWhereTheyAreNot) {
  const Index genus = 4;
  const mesh::Surface surface = test::of_genus(genus, 3);
  Index straighter = 0;
  for (unsigned seed = 0; seed < 3; ++seed) {
    std::vector<Index> cones(30, 5);
    cones.insert(cones.end(), 6, 3);
    cones = test::scattered(surface, cones, seed);
    ExecutionContext context;
    const std::vector<double> crossings = flat_crossings(surface, cones, context);
    Canvas canvas(surface, cones);
    const TurnMeter meter(canvas, crossings);
    const Holes holes(canvas, draw_short_loops(canvas, genus, {}, nullptr, context));
    for (Index to = 1; to < holes.count(); ++to) {
      const std::vector<HalfedgeId> shortest =
          free_path(canvas, {holes.open_sectors(0), {}},
                    {[&](HalfedgeId sector) { return holes.has(to, sector); }, nullptr}, context);
      ASSERT_FALSE(shortest.empty());
      const double length = length_of(canvas, shortest);
      const Found found = cheapest(meter, holes, 0, to, {0.0});
      ASSERT_FALSE(found.path.empty());
      EXPECT_NEAR(found.length, length, 1e-9);
      const TurningPrice price{10.0};
      const Found straight = cheapest(meter, holes, 0, to, price);
      ASSERT_FALSE(straight.path.empty());
      EXPECT_NEAR(length_of(canvas, straight.path), straight.length, 1e-9);
      EXPECT_NEAR(turn_of(meter, straight.path), straight.turned, 1e-9);
      const double own = turn_of(meter, shortest);
      EXPECT_LE(std::abs(straight.turned), std::abs(own) + 1e-9);
      EXPECT_LE(price.cost(straight.length, straight.turned), price.cost(length, own) + 1e-9);
      straighter += std::abs(straight.turned) < std::abs(own) - 1.0;
      // From curve to curve through free vertices, none twice.
      std::set<VertexId> seen;
      for (std::size_t i = 0; i + 1 < straight.path.size(); ++i) {
        const VertexId v = canvas.mesh().target(straight.path[i]);
        EXPECT_EQ(canvas.mesh().source(straight.path[i + 1]), v);
        EXPECT_TRUE(canvas.is_free(v));
        EXPECT_TRUE(seen.insert(v).second);
      }
    }
  }
  EXPECT_GE(straighter, 3);
}

TEST(TurningPath, CanBeCancelledAndEndsWithItsBudget) {
  const mesh::Surface surface = test::of_genus(3, 8);
  const std::vector<Index> cones = test::scattered(surface, std::vector<Index>(16, 5), 1);
  ExecutionContext context;
  const std::vector<double> crossings = flat_crossings(surface, cones, context);
  Canvas canvas(surface, cones);
  const TurnMeter meter(canvas, crossings);
  const Holes holes(canvas, draw_short_loops(canvas, 3, {}, nullptr, context));
  TurningSearch search(meter);
  canvas.for_each_inside(holes.open_sectors(0).front(),
                         [&](HalfedgeId h) { search.start(h, 0.0); });
  std::int64_t ways_left = 1000;
  EXPECT_THROW(
      search.run([](const TurningSearch::Arrival&) {},
                 [] { return std::numeric_limits<double>::infinity(); }, &ways_left, context),
      NotConverged);
  context.cancel();
  EXPECT_THROW(search.run([](const TurningSearch::Arrival&) {},
                          [] { return std::numeric_limits<double>::infinity(); }, nullptr, context),
               Cancelled);
}

}  // namespace
}  // namespace flipfree::seamless::turning_path_test
