#include "flipfree/seamless/padding/reroute/detours.h"

#include "flipfree/seamless/padding/reroute/loop_turns.h"
#include "seamless/padding/paths/canvases.h"
#include "seamless/padding/reroute/wished_fields.h"

namespace flipfree::seamless::detours_test {
namespace {

// A torus with two cones and a square drawn on it; what a field turns by along its first branch.
struct Square {
  test::GridTorus torus{8, 6};
  std::vector<Index> cones =
      test::cones_at(torus.surface, {{torus.at(3, 3), 2}, {torus.at(5, 2), 6}});
  mesh::Adjacency adjacency = mesh::build_adjacency(48, torus.surface.faces);
  Canvas canvas{torus.surface, cones};
  BranchGraph graph;
  field::CrossField field;

  Square() {
    test::draw_square(canvas, torus);
    graph = branch_graph(canvas);
    std::mt19937 random(1);
    field = test::wished_field(torus.surface, cones, 1, random);
  }
  Index turn() const {
    return field::turning_number(adjacency, field, strip_on_input(canvas, adjacency, graph, {0}));
  }
  void expect_changed(const std::vector<VertexId>& branch, Index change) {
    const Index before = turn_;
    graph.branches[0].vertices = branch;
    EXPECT_EQ(turn(), before + change);
    EXPECT_EQ(branch.front(), torus.at(0, 0));
    EXPECT_EQ(branch.back(), torus.at(0, 0));
    EXPECT_EQ(test::unrefined_edge(canvas), kInvalid);
    // Still one disk with four corners, and what is drawn is what is said.
    EXPECT_EQ(disk_boundary(canvas).corners_below.back(), 4);
    for (std::size_t i = 0; i + 1 < branch.size(); ++i)
      EXPECT_EQ(canvas.curve(canvas.mesh().find(branch[i], branch[i + 1])), graph.branches[0].kind);
  }
  Index turn_ = 0;
};

TEST(Detours, TheShortestOneChangesTheTurnAsAsked) {
  for (const Index change : {-2, 2}) {
    Square square;
    ExecutionContext context;
    square.turn_ = square.turn();
    const auto branch =
        draw_shortest_detour(square.canvas, square.graph.branches[0].vertices, change, context);
    ASSERT_TRUE(branch);
    square.expect_changed(*branch, change);
  }
}

TEST(Detours, OnesAroundConesCanBeDrawnOneAfterTheOther) {
  for (const Index change : {-2, 2}) {
    Square square;
    ExecutionContext context;
    for (int round = 0; round < 3; ++round) {
      square.turn_ = square.turn();
      const Detour detour = draw_detour_around_cone(
          square.canvas, square.graph.branches[0].vertices, {change}, context);
      EXPECT_EQ(detour.change, change);
      square.expect_changed(detour.branch, change);
    }
  }
}

TEST(Detours, NoneChangesTheTurnByWhatNoConesDo) {
  Square square;
  ExecutionContext context;
  EXPECT_FALSE(draw_shortest_detour(square.canvas, square.graph.branches[0].vertices, 1, context));
}

}  // namespace
}  // namespace flipfree::seamless::detours_test
