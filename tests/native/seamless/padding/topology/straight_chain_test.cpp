// Chains that turn little: nodes, disk, and how far the disk's metric is.
#include "flipfree/seamless/padding/topology/straight_chain.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "flipfree/seamless/padding/topology/short_loops.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::straight_chain_test {
namespace {

using test::GridTorus;

TEST(StraightChain, HasNodesOfDegreeFourAndOneDisk) {
  for (const Index genus : {2, 3, 4, 7}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 1 + static_cast<Index>(seed % 2));
      const std::vector<Index> cones = test::scattered(
          surface, std::vector<Index>(static_cast<std::size_t>(8 * genus - 8), 5), seed);
      ExecutionContext context;
      const std::vector<double> crossings = flat_crossings(surface, cones, context);
      Canvas canvas(surface, cones);
      draw_straight_chain(canvas, genus, {crossings, 3.0}, context);
      std::map<std::size_t, Index> degrees;
      for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
        if (canvas.on_curve(v) && canvas.drawn_around(v).size() > 2)
          ++degrees[canvas.drawn_around(v).size()];
      }
      EXPECT_EQ(degrees, (std::map<std::size_t, Index>{{4, 2 * genus - 1}}));
      EXPECT_EQ(disk_boundary(canvas).corners_below.back(), 8 * genus - 4);
    }
  }
}

// As of short chains (hole_chain_test.cpp).
TEST(StraightChain, HasTNodesWhereAPathIsToJoinThem) {
  for (const Index genus : {1, 2}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 2);
      const std::vector<Index> cones = test::scattered(
          surface, genus == 1 ? std::vector<Index>{3, 3, 5, 5} : std::vector<Index>(8, 5), seed);
      ExecutionContext context;
      const std::vector<double> crossings = flat_crossings(surface, cones, context);
      Canvas canvas(surface, cones);
      const auto [a, b] =
          draw_straight_chain_with_t_nodes(canvas, genus, {crossings, 3.0}, context);
      EXPECT_NE(a, b);
      for (const VertexId t : {a, b}) EXPECT_EQ(canvas.drawn_around(t).size(), 3U);
      EXPECT_EQ(disk_boundary(canvas).corners_below.back(), 8 * genus - 2);
    }
  }
}

TEST(StraightChain, KeepsTheLoopThatATwistedOneBeginsWith) {
  for (const Index genus : {1, 2, 4}) {
    for (unsigned seed = 0; seed < 3; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 2);
      std::vector<Index> given(static_cast<std::size_t>(4 * genus - 2), 6);
      given.insert(given.end(), 2, 2);
      const std::vector<Index> cones = test::scattered(surface, given, seed);
      ExecutionContext context;
      Canvas canvas(surface, cones);
      const std::vector<VertexId> first = draw_short_loops(canvas, 1, {}, nullptr, context).front();
      const std::vector<double> crossings = flat_crossings(surface, cones, context);
      const auto [a, b] =
          draw_straight_twisted_chain(canvas, first, genus, {crossings, 3.0}, context);
      EXPECT_NE(a, b);
      for (const VertexId t : {a, b})
        EXPECT_NE(std::find(first.begin(), first.end(), t), first.end());
      EXPECT_EQ(disk_boundary(canvas).corners_below.back(), 8 * genus - 2);
    }
  }
}

TEST(StraightChain, StraightAheadIsAcrossTheLoopOnBothSides) {
  // The columns of a torus of revolution are at right angles to its outer row.
  const GridTorus torus(24, 24);
  const std::vector<Index> cones = test::cones_at(torus.surface, {});
  ExecutionContext context;
  const std::vector<double> crossings = flat_crossings(torus.surface, cones, context);
  Canvas canvas(torus.surface, cones);
  const TurnMeter meter(canvas, crossings);
  std::vector<VertexId> row;
  for (Index i = 0; i < 24; ++i) row.push_back(torus.at(i, 0));
  test::Chain closed = row;
  closed.push_back(row.front());
  canvas.draw(test::along(canvas, closed), Curve::kLoop);
  const HoleFrames frames(meter, {row});
  for (Index i = 0; i < 24; i += 5) {
    const HalfedgeId up = canvas.mesh().find(torus.at(i, 0), torus.at(i, 1));
    const HalfedgeId down = canvas.mesh().find(torus.at(i, 0), torus.at(i, -1));
    EXPECT_NEAR(frames.deviation(0, up), 0.0, 0.15);
    EXPECT_NEAR(frames.deviation(1, down), 0.0, 0.15);
    const HalfedgeId aslant = canvas.mesh().find(torus.at(i, 0), torus.at(i + 1, 1));
    EXPECT_LT(frames.deviation(0, aslant), -0.3);
  }
}

TEST(StraightChain, CostsAreSymmetricAndFinite) {
  const Index genus = 9;
  const mesh::Surface surface = test::of_genus(genus, 2);
  const std::vector<Index> cones = test::scattered(surface, std::vector<Index>(64, 5), 6);
  ExecutionContext context;
  const std::vector<double> crossings = flat_crossings(surface, cones, context);
  Canvas canvas(surface, cones);
  const TurnMeter meter(canvas, crossings);
  const auto loops = draw_short_loops(canvas, genus, {}, nullptr, context);
  const Holes holes(canvas, loops);
  const HoleFrames frames(meter, loops);
  const auto free = connector_costs(meter, holes, frames, {0.0}, context);
  const auto cost = connector_costs(meter, holes, frames, {5.0}, context);
  for (std::size_t a = 0; a < cost.size(); ++a) {
    EXPECT_EQ(cost[a][a], 0.0);
    for (std::size_t b = 0; b < a; ++b) {
      EXPECT_EQ(cost[a][b], cost[b][a]);
      EXPECT_TRUE(std::isfinite(cost[a][b]));
      EXPECT_GT(cost[a][b], 0.0);
    }
  }
  // What holes beside each other on the plate cost without turns is no more than with them.
  for (const HolePair& pair : hole_neighbours(canvas, holes, context)) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    EXPECT_LE(free[a][b], cost[a][b] * (1.0 + 1e-9));
  }
}

}  // namespace
}  // namespace flipfree::seamless::straight_chain_test
