// Which pattern cones ask for, and the paths of the existence proof where the search is not asked.
#include "flipfree/seamless/padding/extra_path.h"

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/hole_chain.h"
#include "flipfree/seamless/padding/reroute.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::extra_path_test {
namespace {

void divide(Canvas& canvas) {
  BranchGraph graph = branch_graph(canvas);
  divide_branches(canvas, graph);
}

TEST(ExtraPath, PatternsForAllKindsOfCones) {
  EXPECT_EQ(pattern_for({3, 3, 3, 3, 3, 3, 3, 3}, 0), Pattern::kNone);
  EXPECT_EQ(pattern_for({4, 4, 4}, 1), Pattern::kChain);
  EXPECT_EQ(pattern_for({2, 6}, 1), Pattern::kTwoTNodes);
  EXPECT_EQ(pattern_for({3, 3, 6}, 1), Pattern::kTwoTNodes);
  EXPECT_EQ(pattern_for({1, 7}, 1), Pattern::kLoop);
  EXPECT_EQ(pattern_for({1, 3, 8}, 1), Pattern::kLoop);
  EXPECT_THROW(pattern_for({3, 5}, 1), Infeasible);
  EXPECT_EQ(pattern_for({12}, 2), Pattern::kChain);
  EXPECT_EQ(pattern_for({7, 9}, 2), Pattern::kTwoTNodes);
  EXPECT_EQ(pattern_for({1, 15}, 2), Pattern::kLoop);
  EXPECT_EQ(pattern_for({8, 8, 8, 8}, 3), Pattern::kChain);
  EXPECT_EQ(pattern_for({22, 2}, 3), Pattern::kExtraPath);
  EXPECT_EQ(pattern_for({23, 1}, 3), Pattern::kLoop);
}

// All that the cones of one or several parts with this genus can be, by dynamic programming over
// the excess: only 3 and 5 on a torus have no pattern.
TEST(ExtraPath, EveryAdmissibleListOfUpToFiveConesHasAPattern) {
  for (const Index genus : {1, 2, 3}) {
    const Index total = 8 * genus - 8;
    Index refused = 0;
    std::vector<Index> list;
    const auto visit = [&](auto&& self, Index lowest, Index rest, int left) -> void {
      if (left == 0) {
        const Index last = rest + 4;
        if (last < lowest) return;
        list.push_back(last);
        try {
          pattern_for(list, genus);
        } catch (const Infeasible&) {
          ++refused;
          std::vector<Index> cones;
          for (const Index k : list) {
            if (k != 4) cones.push_back(k);
          }
          EXPECT_EQ(cones, (std::vector<Index>{3, 5}));
        }
        list.pop_back();
        return;
      }
      for (Index k = lowest; k <= 16; ++k) {
        list.push_back(k);
        self(self, k, rest - (k - 4), left - 1);
        list.pop_back();
      }
    };
    for (int cones = 0; cones < 5; ++cones) visit(visit, 1, total, cones);
    EXPECT_EQ(refused > 0, genus == 1);
  }
}

void expect_good(const Canvas& canvas, const std::vector<Index>& cones, Index components) {
  EXPECT_EQ(test::unrefined_edge(canvas), kInvalid);
  std::set<std::set<VertexId>> parts;
  Index corners = 0;
  for (HalfedgeId h = 0; h < canvas.mesh().halfedge_slots(); ++h) {
    if (canvas.curve(h) != Curve::kExtra) continue;
    parts.insert(test::cones_beside(canvas, h));
  }
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (!canvas.on_curve(v)) continue;
    const std::size_t degree = canvas.drawn_around(v).size();
    if (degree > 2) corners += degree == 3 ? 2 : 4;
  }
  EXPECT_EQ(parts.size(), static_cast<std::size_t>(components));
  Index wanted = 0;
  for (const auto& part : parts) {
    Index excess = 0;
    for (const VertexId v : part) excess += cones[static_cast<std::size_t>(v)] - 4;
    EXPECT_NE(excess % 4, 0);
    wanted += 4 + excess;
  }
  EXPECT_EQ(corners, wanted);
}

TEST(ExtraPath, FencedPathsJoinTNodes) {
  const std::vector<std::pair<Index, std::vector<Index>>> cases = {
      {1, {2, 6}},  {1, {3, 3, 5, 5}}, {2, {2, 14}}, {2, {3, 13}},
      {2, {5, 11}}, {2, {6, 10}},      {2, {7, 9}},  {2, {5, 5, 5, 5, 5, 5, 5, 5}}};
  for (const auto& [genus, given] : cases) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 1);
      const std::vector<Index> cones = test::scattered(surface, given, seed);
      Canvas canvas(surface, cones);
      ExecutionContext context;
      const auto t_nodes = draw_chain_with_t_nodes(canvas, genus, context);
      divide(canvas);
      draw_fenced_joining_path(canvas, joinable_sectors(canvas, t_nodes, cones), cones, context);
      expect_good(canvas, cones, 2);
    }
  }
}

TEST(ExtraPath, FencedExtraPathsGoAroundOneCone) {
  for (const Index genus : {3, 4}) {
    for (const Index k : {2, 3, 5, 6, 7}) {
      for (unsigned seed = 0; seed < 4; ++seed) {
        const mesh::Surface surface = test::of_genus(genus, 1);
        const std::vector<Index> cones =
            test::scattered(surface, {k, 8 * genus - 8 - k, 8, 8}, seed);
        Canvas canvas(surface, cones);
        ExecutionContext context;
        draw_hole_chain(canvas, genus, context);
        divide(canvas);
        draw_fenced_extra_path(canvas, cones, genus, context);
        expect_good(canvas, cones, 2);
      }
    }
  }
}

TEST(ExtraPath, ShortestPathsAreFound) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    for (const Index genus : {2, 3}) {
      const mesh::Surface surface = test::of_genus(genus, 1);
      const std::vector<Index> cones = test::scattered(
          surface, std::vector<Index>(static_cast<std::size_t>(8 * genus - 8), 5), seed);
      Canvas canvas(surface, cones);
      ExecutionContext context;
      if (genus == 2) {
        const auto t_nodes = draw_chain_with_t_nodes(canvas, genus, context);
        divide(canvas);
        EXPECT_TRUE(
            draw_shortest_joining_path(canvas, joinable_sectors(canvas, t_nodes, cones), context));
      } else {
        draw_hole_chain(canvas, genus, context);
        divide(canvas);
        EXPECT_TRUE(draw_shortest_extra_path(canvas, context));
      }
      expect_good(canvas, cones, 2);
    }
  }
}

TEST(ExtraPath, LoopsGoAroundConesOfOneQuarterTurn) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const mesh::Surface surface = test::of_genus(2, 1);
    const std::vector<Index> cones = test::scattered(surface, {1, 1, 18}, seed);
    Canvas canvas(surface, cones);
    ExecutionContext context;
    draw_hole_chain(canvas, 2, context);
    divide(canvas);
    draw_loop_around_cone(canvas, sectors_on_holes(canvas), cones, context);
    expect_good(canvas, cones, 2);
  }
}

}  // namespace
}  // namespace flipfree::seamless::extra_path_test
