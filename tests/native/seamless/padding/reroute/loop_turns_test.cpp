#include "flipfree/seamless/padding/reroute/loop_turns.h"

#include "seamless/padding/paths/canvases.h"
#include "seamless/padding/reroute/wished_fields.h"

namespace flipfree::seamless::reroute_loop_turns_test {
namespace {

TEST(LoopTurns, EndingsBendWhatTheyMeet) {
  const test::GridTorus torus(8, 6);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  test::draw_square(canvas, torus);
  const BranchGraph graph = branch_graph(canvas);
  EXPECT_EQ(turn_to_come(graph, {0}, {}), 0);
  EXPECT_EQ(turn_to_come(graph, {1}, {}), 0);
  EXPECT_EQ(turn_to_come(graph, {0}, {{}, 0}), -1);
  EXPECT_EQ(turn_to_come(graph, {0}, {{}, 1}), 1);
  EXPECT_EQ(turn_to_come(graph, {0}, {{}, 2}), 0);
  // A sector on the left, and one on the right.
  EXPECT_EQ(turn_to_come(graph, {0}, {{0}}), -1);
  EXPECT_EQ(turn_to_come(graph, {0}, {{1}}), 0);
  // Around one corner of the square.
  const Index left = graph.next_end[0];
  EXPECT_EQ(turn_to_come(graph, {0, left}, {}) + turn_to_come(graph, {left ^ 1, 1}, {}), 0);
}

TEST(LoopTurns, StripsRunBesideTheLoopAndAreThoseOfTheInput) {
  const test::GridTorus torus(8, 6);
  const std::vector<Index> cones =
      test::cones_at(torus.surface, {{torus.at(3, 3), 3}, {torus.at(5, 2), 5}});
  const mesh::Adjacency adjacency = mesh::build_adjacency(48, torus.surface.faces);
  Canvas canvas(torus.surface, cones);
  test::draw_square(canvas, torus);
  BranchGraph graph = branch_graph(canvas);
  std::mt19937 random(1);
  const field::CrossField field = test::wished_field(torus.surface, cones, 2, random);
  for (const BranchLoop& loop : homology_loops(graph)) {
    const intrinsic::DualLoop strip = strip_on_input(canvas, adjacency, graph, loop);
    for (std::size_t i = 0; i < strip.size(); ++i) {
      const HalfedgeId entered = adjacency.opposite[static_cast<std::size_t>(strip[i])];
      EXPECT_EQ(entered / 3, strip[(i + 1) % strip.size()] / 3);
      EXPECT_NE(entered, strip[(i + 1) % strip.size()]);
    }
    // Walked the other way it turns the other way, on its other side too: nothing is between.
    const Index turn = field::turning_number(adjacency, field, strip);
    const intrinsic::DualLoop back = strip_on_input(canvas, adjacency, graph, {loop.front() ^ 1});
    EXPECT_EQ(field::turning_number(adjacency, field, back), -turn);
  }
}

}  // namespace
}  // namespace flipfree::seamless::reroute_loop_turns_test
