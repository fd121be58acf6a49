// Holes, who is beside whom, and the order in which they are strung up.
#include "flipfree/seamless/padding/topology/holes.h"

#include <cmath>

#include "flipfree/seamless/padding/topology/short_loops.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::holes_test {
namespace {

using test::GridTorus;

TEST(Holes, SectorsAreOnTheirSideOfTheLoop) {
  const GridTorus torus(8, 8);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  canvas.draw(test::along(canvas, {0, 1, 2, 3, 4, 5, 6, 7, 0}), Curve::kLoop);
  const Holes holes(canvas, {{0, 1, 2, 3, 4, 5, 6, 7}});
  EXPECT_EQ(holes.count(), 2);
  const HalfedgeId above = canvas.mesh().find(3, 4);
  const HalfedgeId below = canvas.mesh().find(3, 2);
  EXPECT_EQ(holes.sectors_at(0, 3), std::vector<HalfedgeId>{above});
  EXPECT_EQ(holes.sectors_at(1, 3), std::vector<HalfedgeId>{below});
  EXPECT_TRUE(holes.has(0, above));
  EXPECT_FALSE(holes.has(1, above));
  EXPECT_EQ(holes.open_sectors(0).size(), 8u);
  EXPECT_EQ(holes.loop_of(3), 0);
  EXPECT_EQ(holes.loop_of(torus.at(3, 3)), kInvalid);
  // A connector divides the sector above.
  canvas.draw(test::along(canvas, {torus.at(3, 0), torus.at(3, 1), torus.at(3, 2)}),
              Curve::kConnector);
  EXPECT_EQ(holes.sectors_at(0, 3).size(), 2u);
  EXPECT_EQ(holes.sectors_at(1, 3).size(), 1u);
  EXPECT_FALSE(holes.is_open(3));
  EXPECT_EQ(holes.open_sectors(1).size(), 7u);
}

TEST(Holes, NeighboursAreFoundOnBothSidesOfARing) {
  const GridTorus torus(6, 12);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  std::vector<std::vector<VertexId>> loops;
  for (const Index row : {0, 4, 8}) {
    test::Chain chain;
    for (Index i = 0; i <= 6; ++i) chain.push_back(torus.at(i, row));
    canvas.draw(test::along(canvas, chain), Curve::kLoop);
    chain.pop_back();
    loops.push_back(chain);
  }
  ExecutionContext context;
  std::set<std::pair<Index, Index>> pairs;
  for (const HolePair& pair : hole_neighbours(canvas, Holes(canvas, loops), context)) {
    pairs.insert({pair.a, pair.b});
    EXPECT_GT(pair.distance, 0.0);
  }
  EXPECT_EQ(pairs, (std::set<std::pair<Index, Index>>{{0, 3}, {2, 5}, {1, 4}}));
}

// Holes in random places of a square: what the order must fulfil, and that it is no worse than a
// random one.
TEST(Holes, OrderEndsInPartnersAndHasAnOddCouple) {
  std::mt19937 random(7);
  const auto coordinate = [&] { return static_cast<double>(random() % 1000) / 1000.0; };
  for (const Index loops : {1, 2, 3, 4, 5, 9, 30}) {
    const Index count = 2 * loops;
    std::vector<Vector2> places;
    for (Index i = 0; i < count; ++i) places.emplace_back(coordinate(), coordinate());
    const auto apart = [&](Index a, Index b) {
      return (places[static_cast<std::size_t>(a)] - places[static_cast<std::size_t>(b)]).norm();
    };
    std::vector<HolePair> pairs;
    for (Index a = 0; a < count; ++a) {
      for (Index b = a + 1; b < count; ++b) {
        if (loops < 9 || apart(a, b) < 0.2) pairs.push_back({a, b, apart(a, b)});
      }
    }
    const std::vector<Index> order = hole_order(count, pairs, loops > 2);
    EXPECT_EQ(std::set<Index>(order.begin(), order.end()).size(), order.size());
    ASSERT_EQ(order.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(order.back(), partner_of(order.front()));
    Index odd_couples = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      for (std::size_t j = i + 2; j < order.size(); j += 2)
        odd_couples += order[j] == partner_of(order[i]);
    }
    EXPECT_EQ(odd_couples > 0, loops > 2);
    if (loops < 9) continue;
    double length = 0.0;
    double by_number = 0.0;
    for (std::size_t i = 1; i < order.size(); ++i) {
      length += apart(order[i - 1], order[i]);
      by_number += apart(static_cast<Index>(i - 1), static_cast<Index>(i));
    }
    EXPECT_LT(length, 0.7 * by_number);
  }
}

TEST(Holes, OddCouplesAreMadeWhereThereAreNone) {
  // A string of partners beside each other.
  const std::vector<HolePair> string = {
      {0, 2, 1.0}, {2, 3, 1.0}, {3, 4, 1.0}, {4, 5, 1.0}, {5, 1, 1.0}};
  EXPECT_EQ(hole_order(6, string, false), (std::vector<Index>{0, 2, 3, 4, 5, 1}));
  EXPECT_EQ(hole_order(6, string, true), (std::vector<Index>{0, 2, 4, 3, 5, 1}));
}

}  // namespace
}  // namespace flipfree::seamless::holes_test
