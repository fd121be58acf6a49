#include "flipfree/seamless/padding/reroute/branch_graph.h"

#include <set>

#include "flipfree/seamless/padding/topology/hole_chain.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::branch_graph_test {
namespace {

TEST(BranchGraph, ASquareHasOneNodeAndTwoBranches) {
  const test::GridTorus torus(8, 6);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  test::draw_square(canvas, torus);
  const BranchGraph graph = branch_graph(canvas);
  ASSERT_EQ(graph.branches.size(), 2U);
  std::set<Index> around;
  Index end = 0;
  do {
    around.insert(end);
    EXPECT_EQ(graph.node(end), torus.at(0, 0));
    EXPECT_EQ(end_of(canvas, graph, leaving(canvas, graph, end)), end);
    end = graph.next_end[static_cast<std::size_t>(end)];
  } while (end != 0);
  EXPECT_EQ(around.size(), 4U);
  // Rows and columns cross.
  EXPECT_NE(graph.next_end[0], 1);
  EXPECT_EQ(homology_loops(graph), (std::vector<BranchLoop>{{0}, {2}}));
}

TEST(BranchGraph, LoopsAreTwoPerHandleWithABranchOfTheirOwn) {
  for (const Index genus : {1, 2, 3, 5}) {
    const mesh::Surface surface = test::of_genus(genus, 1);
    Canvas canvas(surface, test::cones_at(surface, {}));
    ExecutionContext context;
    draw_hole_chain(canvas, genus, context);
    const BranchGraph graph = branch_graph(canvas);
    const std::vector<BranchLoop> loops = homology_loops(graph);
    EXPECT_EQ(loops.size(), static_cast<std::size_t>(2 * genus));
    std::multiset<Index> used;
    for (const BranchLoop& loop : loops) {
      for (std::size_t i = 0; i < loop.size(); ++i) {
        EXPECT_EQ(graph.node(loop[i] ^ 1), graph.node(loop[(i + 1) % loop.size()]));
        used.insert(loop[i] / 2);
      }
    }
    for (const BranchLoop& loop : loops) EXPECT_EQ(used.count(loop.front() / 2), 1U);
  }
}

TEST(BranchGraph, DividedBranchesHaveFourEdges) {
  const test::GridTorus torus(3, 3);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  test::draw_square(canvas, torus);
  BranchGraph graph = branch_graph(canvas);
  divide_branches(canvas, graph);
  const BranchGraph again = branch_graph(canvas);
  for (std::size_t b = 0; b < 2; ++b) {
    EXPECT_EQ(graph.branches[b].vertices.size(), 5U);
    EXPECT_EQ(graph.branches[b].vertices, again.branches[b].vertices);
  }
}

}  // namespace
}  // namespace flipfree::seamless::branch_graph_test
