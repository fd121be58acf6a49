#include "flipfree/field/topology/tree_cotree.h"

#include <gtest/gtest.h>

#include "field/fields.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::field::tree_cotree_test {
namespace {

TEST(TreeCotreeTest, LoopsAreClosedStripsWithoutAFaceTwice) {
  for (const Place& p : places()) {
    const ExecutionContext context;
    const TreeCotree tree = tree_cotree(p.surface, p.adjacency, context);
    EXPECT_EQ(tree.loops.size(),
              2 * static_cast<std::size_t>(mesh::topology(p.surface.faces, p.adjacency).genus()));
    for (const intrinsic::DualLoop& loop : tree.loops) {
      std::vector<char> seen(p.faces(), 0);
      for (std::size_t i = 0; i < loop.size(); ++i) {
        const HalfedgeId entered = p.adjacency.opposite[static_cast<std::size_t>(loop[i])];
        EXPECT_EQ(entered / 3, loop[(i + 1) % loop.size()] / 3);
        EXPECT_EQ(seen[static_cast<std::size_t>(entered / 3)]++, 0);
      }
    }
  }
}

TEST(TreeCotreeTest, EveryChainCrossesItsOwnLoopOnceAndNoOther) {
  for (const Place& p : places()) {
    const ExecutionContext context;
    const TreeCotree tree = tree_cotree(p.surface, p.adjacency, context);
    for (std::size_t i = 0; i < tree.loops.size(); ++i) {
      std::vector<Index> on(3 * p.faces(), 0);
      for (const HalfedgeId h : chain_of(p.surface.faces, p.adjacency, tree, i)) {
        ++on[static_cast<std::size_t>(h)];
        --on[static_cast<std::size_t>(p.adjacency.opposite[static_cast<std::size_t>(h)])];
      }
      for (std::size_t j = 0; j < tree.loops.size(); ++j) {
        Index crossings = 0;
        for (const HalfedgeId h : tree.loops[j]) crossings += on[static_cast<std::size_t>(h)];
        EXPECT_EQ(crossings, i == j ? 1 : 0);
      }
    }
  }
}

TEST(TreeCotreeTest, TheTreeReachesEveryVertexOverItsParent) {
  for (const Place& p : places()) {
    const ExecutionContext context;
    const TreeCotree tree = tree_cotree(p.surface, p.adjacency, context);
    std::vector<char> seen(tree.to_parent.size(), 0);
    Index roots = 0;
    for (const VertexId v : tree.order) {
      const HalfedgeId up = tree.to_parent[static_cast<std::size_t>(v)];
      seen[static_cast<std::size_t>(v)] = 1;
      if (up == kInvalid) {
        ++roots;
        continue;
      }
      const VertexId from = mesh::source(p.surface.faces, up);
      const VertexId to = mesh::target(p.surface.faces, up);
      EXPECT_EQ(tree.stands_for[static_cast<std::size_t>(from)], v);
      EXPECT_EQ(seen[static_cast<std::size_t>(tree.stands_for[static_cast<std::size_t>(to)])], 1);
    }
    EXPECT_EQ(roots, 1);
    for (std::size_t v = 0; v < seen.size(); ++v)
      EXPECT_EQ(seen[v] != 0, tree.stands_for[v] == static_cast<VertexId>(v));
  }
}

}  // namespace
}  // namespace flipfree::field::tree_cotree_test
