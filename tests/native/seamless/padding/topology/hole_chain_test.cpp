// Chains of holes: nodes and disk.
#include "flipfree/seamless/padding/topology/hole_chain.h"

#include <algorithm>
#include <map>

#include "flipfree/seamless/padding/topology/short_loops.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::hole_chain_test {
namespace {

std::map<std::size_t, Index> node_degrees(const Canvas& canvas) {
  std::map<std::size_t, Index> count;
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.on_curve(v) && canvas.drawn_around(v).size() > 2)
      ++count[canvas.drawn_around(v).size()];
  }
  return count;
}

TEST(HoleChain, HasNodesOfDegreeFourAndOneDisk) {
  for (const Index genus : {1, 2, 3, 4, 7}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 1);
      Canvas canvas(surface, test::scattered(surface, std::vector<Index>(10, 5), seed));
      ExecutionContext context;
      draw_hole_chain(canvas, genus, context);
      EXPECT_EQ(node_degrees(canvas), (std::map<std::size_t, Index>{{4, 2 * genus - 1}}));
      EXPECT_EQ(disk_boundary(canvas).corners_below.back(), 8 * genus - 4);
    }
  }
}

TEST(HoleChain, TNodesAreWhereAPathCanJoinThem) {
  for (const Index genus : {1, 2}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 2);
      Canvas canvas(surface, test::scattered(surface, std::vector<Index>(10, 5), seed));
      ExecutionContext context;
      const auto [a, b] = draw_chain_with_t_nodes(canvas, genus, context);
      const auto degrees = node_degrees(canvas);
      EXPECT_EQ(degrees.at(3), 2);
      EXPECT_EQ(degrees.size(), genus == 1 ? 1u : 2u);
      const DiskBoundary boundary = disk_boundary(canvas);
      EXPECT_EQ(boundary.corners_below.back(), 8 * genus - 2);
      // Corners of the smaller part of every path that joins them.
      std::set<Index> parts;
      for (const HalfedgeId from : canvas.drawn_around(a)) {
        for (const HalfedgeId to : canvas.drawn_around(b)) {
          const Index corners =
              2 + boundary.corners_between(boundary.place[static_cast<std::size_t>(from)],
                                           boundary.place[static_cast<std::size_t>(to)]);
          parts.insert(std::min(corners, 8 * genus - corners));
        }
      }
      if (genus == 1) {
        EXPECT_EQ(parts, (std::set<Index>{2, 4}));
      } else {
        for (const Index corners : {2, 3, 5, 6, 7}) EXPECT_TRUE(parts.contains(corners)) << corners;
      }
    }
  }
}

TEST(HoleChain, ATwistedOneHasTNodesOnItsFirstLoopWithHalfOfTheCornersBetween) {
  for (const Index genus : {1, 2, 3, 5}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 2);
      Canvas canvas(surface, test::scattered(surface, std::vector<Index>(10, 6), seed));
      ExecutionContext context;
      const std::vector<VertexId> first = draw_short_loops(canvas, 1, {}, nullptr, context).front();
      const auto [a, b] = draw_twisted_chain(canvas, first, genus, context);
      EXPECT_NE(a, b);
      for (const VertexId t : {a, b}) {
        EXPECT_EQ(canvas.drawn_around(t).size(), 3U);
        EXPECT_NE(std::find(first.begin(), first.end(), t), first.end());
      }
      std::map<std::size_t, Index> degrees = {{3, 2}};
      if (genus > 1) degrees[4] = 2 * genus - 2;
      EXPECT_EQ(node_degrees(canvas), degrees);
      const DiskBoundary boundary = disk_boundary(canvas);
      EXPECT_EQ(boundary.corners_below.back(), 8 * genus - 2);
      std::multiset<Index> parts;
      for (const HalfedgeId from : canvas.drawn_around(a)) {
        for (const HalfedgeId to : canvas.drawn_around(b)) {
          const Index corners =
              2 + boundary.corners_between(boundary.place[static_cast<std::size_t>(from)],
                                           boundary.place[static_cast<std::size_t>(to)]);
          parts.insert(std::min(corners, 8 * genus - corners));
        }
      }
      EXPECT_EQ(parts.count(2), genus == 1 ? 6U : 4U);
      EXPECT_EQ(parts.count(4 * genus - 2), genus == 1 ? 6U : 2U);
      EXPECT_EQ(parts.count(4 * genus), 3U);
    }
  }
}

}  // namespace
}  // namespace flipfree::seamless::hole_chain_test
