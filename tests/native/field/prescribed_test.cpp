#include "flipfree/field/prescribed.h"

#include <gtest/gtest.h>

#include "field/fields.h"
#include "flipfree/base/error.h"
#include "flipfree/field/turning.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::field::prescribed_test {
namespace {

// Cones of 3 and 5 quarter turns at random vertices.
std::vector<Index> random_cones(const Place& p, Index pairs, unsigned seed) {
  const auto count = static_cast<std::size_t>(p.surface.vertices.rows());
  std::vector<Index> cones(count, 4);
  std::mt19937 random(seed);
  const auto any = [&] { return random() % count; };
  for (Index i = 0; i < pairs; ++i) {
    --cones[any()];
    ++cones[any()];
  }
  const Index lack = 8 - 8 * mesh::topology(p.surface.faces, p.adjacency).genus();
  for (Index i = 0; i < std::abs(lack); ++i) cones[any()] += lack > 0 ? -1 : 1;
  return cones;
}

TEST(PrescribedTest, ConesAndTurnsAreExactlyThoseAskedFor) {
  for (const Place& p : places()) {
    if (mesh::topology(p.surface.faces, p.adjacency).boundary_loops > 0) continue;
    for (unsigned seed = 0; seed < 6; ++seed) {
      ExecutionContext context;
      const std::vector<Index> cones = random_cones(p, 4, seed);
      std::vector<LoopTurn> loops;
      std::mt19937 random(seed + 100);
      for (DualLoop& loop : tree_cotree(p.surface, p.adjacency, context).loops)
        loops.push_back({std::move(loop), static_cast<Index>(random() % 9) - 4});
      const CrossField field =
          field_with_signature(p.surface, p.adjacency, p.frames, cones, loops, context);
      EXPECT_EQ(cone_turns(p.surface.faces, p.adjacency, p.frames, field), cones);
      for (const LoopTurn& loop : loops)
        EXPECT_EQ(turning_number(p.adjacency, field, loop.loop), loop.quarter_turns);
    }
  }
}

TEST(PrescribedTest, AnyBasisServes) {
  // Loops that are homologous to sums of those of the tree: those that a field's own shape needs.
  const Place p(test::torus(12, 8));
  ExecutionContext context;
  const TreeCotree tree = tree_cotree(p.surface, p.adjacency, context);
  // Around the tube, along a row of faces; and one of the tree's that crosses it.
  const std::vector<Index> cones = random_cones(p, 3, 2);
  for (std::size_t i = 0; i < 2; ++i) {
    std::vector<LoopTurn> loops = {{tree.loops[i], 2}, {tree.loops[1 - i], -1}};
    DualLoop reversed;
    for (auto h = loops[0].loop.rbegin(); h != loops[0].loop.rend(); ++h)
      reversed.push_back(p.adjacency.opposite[static_cast<std::size_t>(*h)]);
    loops[0] = {reversed, -2};
    const CrossField field =
        field_with_signature(p.surface, p.adjacency, p.frames, cones, loops, context);
    EXPECT_EQ(turning_number(p.adjacency, field, tree.loops[i]), 2);
    EXPECT_EQ(turning_number(p.adjacency, field, tree.loops[1 - i]), -1);
  }
}

TEST(PrescribedTest, LoopsThatAreNoBasisAreRefused) {
  const Place p(test::torus(6, 5));
  ExecutionContext context;
  const std::vector<Index> cones(static_cast<std::size_t>(p.surface.vertices.rows()), 4);
  const TreeCotree tree = tree_cotree(p.surface, p.adjacency, context);
  const auto refused = [&](const std::vector<LoopTurn>& loops) {
    EXPECT_THROW(field_with_signature(p.surface, p.adjacency, p.frames, cones, loops, context),
                 InvalidInput);
  };
  refused({{tree.loops[0], 0}});
  refused({{tree.loops[0], 0}, {tree.loops[0], 0}});
  refused({{tree.loops[0], 0}, {{}, 0}});
  refused({{tree.loops[0], 0}, {{0, 5}, 0}});
  refused({{tree.loops[0], 0}, {{-1}, 0}});
}

}  // namespace
}  // namespace flipfree::field::prescribed_test
