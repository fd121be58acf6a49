// Loops that cross chosen branches of a cut, and no others.
#include "flipfree/seamless/padding/reroute/odd_loop.h"

#include <set>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/seamless/padding/topology/hole_chain.h"
#include "seamless/padding/paths/canvases.h"
#include "seamless/padding/reroute/wished_fields.h"

namespace flipfree::seamless::odd_loop_test {
namespace {

// Does cutting along all that is drawn leave the surface in one piece?
bool in_one_piece(const Canvas& canvas) {
  DisjointSets pieces(canvas.mesh().face_slots());
  for (HalfedgeId h = 0; h < canvas.mesh().halfedge_slots(); ++h) {
    if (!canvas.is_drawn(h)) pieces.join(h / 3, canvas.mesh().opposite(h) / 3);
  }
  for (FaceId f = 1; f < canvas.mesh().face_slots(); ++f) {
    if (pieces.find(f) != pieces.find(0)) return false;
  }
  return true;
}

void check(Canvas& canvas, const std::vector<Index>& branches) {
  BranchGraph graph = branch_graph(canvas);
  divide_branches(canvas, graph);
  ExecutionContext context;
  const std::vector<VertexId> loop = draw_loop_across(canvas, graph, branches, context);
  const std::set<VertexId> vertices(loop.begin(), loop.end());
  EXPECT_EQ(vertices.size(), loop.size());
  for (std::size_t i = 0; i < loop.size(); ++i) {
    EXPECT_EQ(canvas.drawn_around(loop[i]).size(), 2U);
    EXPECT_EQ(canvas.curve(canvas.mesh().find(loop[i], loop[(i + 1) % loop.size()])), Curve::kLoop);
  }
  Index drawn = 0;
  for (HalfedgeId h = 0; h < canvas.mesh().halfedge_slots(); ++h)
    drawn += canvas.is_drawn(h) ? 1 : 0;
  EXPECT_EQ(drawn, 2 * static_cast<Index>(loop.size()));
  for (Index b = 0; at(b) < graph.branches.size(); ++b) {
    const bool chosen = std::find(branches.begin(), branches.end(), b) != branches.end();
    Index met = 0;
    for (const VertexId v : graph.branches[at(b)].vertices) met += vertices.contains(v) ? 1 : 0;
    EXPECT_EQ(met, chosen ? 1 : 0) << b;
  }
  // It meets some loop of the graph once.
  EXPECT_TRUE(in_one_piece(canvas));
  EXPECT_EQ(test::unrefined_edge(canvas), kInvalid);
}

TEST(OddLoop, CrossesTheBranchesOfASquare) {
  for (const std::vector<Index>& branches : std::vector<std::vector<Index>>{{0}, {1}, {0, 1}}) {
    const test::GridTorus torus(8, 6);
    Canvas canvas(torus.surface, test::cones_at(torus.surface, {{torus.at(4, 4), 6}}));
    test::draw_square(canvas, torus);
    check(canvas, branches);
  }
}

TEST(OddLoop, CrossesAnyBranchesOfAHoleChainOnce) {
  std::mt19937 random(7);
  for (const Index genus : {2, 3, 5}) {
    for (int round = 0; round < 6; ++round) {
      const mesh::Surface surface = test::of_genus(genus, 1);
      Canvas canvas(surface, test::scattered(surface, {2, 6, 6}, static_cast<unsigned>(random())));
      ExecutionContext context;
      draw_hole_chain(canvas, genus, context);
      std::vector<Index> branches;
      for (const BranchLoop& loop : homology_loops(branch_graph(canvas))) {
        if (random() % 2 == 0 || round == 0) branches.push_back(loop.front() / 2);
      }
      if (!branches.empty()) check(canvas, branches);
    }
  }
}

TEST(OddLoop, BranchesAreOddWhereTheFieldTurnsByAnOddNumber) {
  const mesh::Surface surface = test::of_genus(2, 1);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const std::vector<Index> cones = test::scattered(surface, {6, 6, 6, 6}, 1);
  Canvas canvas(surface, cones);
  ExecutionContext context;
  draw_hole_chain(canvas, 2, context);
  BranchGraph graph = branch_graph(canvas);
  divide_branches(canvas, graph);
  std::mt19937 random(3);
  Reroutings done;
  std::set<std::size_t> counts;
  for (int round = 0; round < 8; ++round) {
    const field::CrossField field = test::wished_field(surface, cones, 1, random);
    const WishedTurns wished = test::turns_of(surface, adjacency, field, done);
    const std::vector<Index> odd = odd_branches(canvas, adjacency, graph, wished.turning);
    counts.insert(odd.size());
    for (const BranchLoop& loop : homology_loops(graph)) {
      const Index turns = wished.turning(strip_on_input(canvas, adjacency, graph, loop));
      EXPECT_EQ(std::count(odd.begin(), odd.end(), loop.front() / 2), turns % 2 == 0 ? 0 : 1);
    }
  }
  EXPECT_GT(counts.size(), 1U);
}

}  // namespace
}  // namespace flipfree::seamless::odd_loop_test
