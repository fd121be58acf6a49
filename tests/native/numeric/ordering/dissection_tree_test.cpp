// Repair of an elimination order after flips: what it must keep, and that it stays good.
#include "flipfree/numeric/ordering/dissection_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <set>
#include <vector>

#include "flipfree/numeric/cholesky/cholesky.h"
#include "flipfree/numeric/ordering/nested_dissection.h"

namespace flipfree::numeric::dissection_tree_test {
namespace {

// A triangulated grid whose squares can swap their diagonals: the graph of a mesh under flips.
class FlippedGrid {
 public:
  FlippedGrid(Index columns, Index rows)
      : columns_(columns), rows_(rows), other_(static_cast<std::size_t>(columns * rows), false) {}

  void flip_share(double share, std::mt19937& random) {
    std::bernoulli_distribution coin(share);
    for (std::size_t i = 0; i < other_.size(); ++i) {
      if (coin(random)) other_[i] = !other_[i];
    }
  }
  std::set<std::pair<Index, Index>> edges() const {
    std::set<std::pair<Index, Index>> edges;
    for (Index y = 0; y < rows_; ++y) {
      for (Index x = 0; x < columns_; ++x) {
        const Index v = y * columns_ + x;
        if (x + 1 < columns_) edges.emplace(v, v + 1);
        if (y + 1 < rows_) edges.emplace(v, v + columns_);
        if (x + 1 < columns_ && y + 1 < rows_) {
          if (other_[static_cast<std::size_t>(v)]) {
            edges.emplace(v + 1, v + columns_);
          } else {
            edges.emplace(v, v + columns_ + 1);
          }
        }
      }
    }
    return edges;
  }
  Graph graph() const {
    Graph graph;
    const Index n = columns_ * rows_;
    std::vector<std::vector<Index>> near(static_cast<std::size_t>(n));
    for (const auto& [a, b] : edges()) {
      near[static_cast<std::size_t>(a)].push_back(b);
      near[static_cast<std::size_t>(b)].push_back(a);
    }
    graph.offset.push_back(0);
    for (const auto& list : near) {
      graph.neighbour.insert(graph.neighbour.end(), list.begin(), list.end());
      graph.offset.push_back(static_cast<Index>(graph.neighbour.size()));
    }
    return graph;
  }
  SparseMatrix laplacian() const {
    std::vector<Eigen::Triplet<double, Index>> entries;
    const Index n = columns_ * rows_;
    for (Index v = 0; v < n; ++v) entries.emplace_back(v, v, 1e-2);
    for (const auto& [a, b] : edges()) {
      entries.emplace_back(b, a, -1.0);
      entries.emplace_back(a, a, 1.0);
      entries.emplace_back(b, b, 1.0);
    }
    SparseMatrix matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
  }

 private:
  Index columns_;
  Index rows_;
  std::vector<bool> other_;
};

// The tree separates, and the order is a permutation in its postorder.
void expect_dissected(const Graph& graph, const DissectionTree& tree,
                      const std::vector<Index>& order) {
  for (Index v = 0; v < graph.count(); ++v) {
    for (Index i = graph.offset[static_cast<std::size_t>(v)];
         i < graph.offset[static_cast<std::size_t>(v) + 1]; ++i) {
      const Index u = graph.neighbour[static_cast<std::size_t>(i)];
      ASSERT_TRUE(
          on_one_branch(tree[static_cast<std::size_t>(v)], tree[static_cast<std::size_t>(u)]))
          << v << " " << u;
    }
  }
  std::vector<Index> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (Index i = 0; i < graph.count(); ++i) ASSERT_EQ(sorted[static_cast<std::size_t>(i)], i);
  for (std::size_t i = 1; i < order.size(); ++i) {
    ASSERT_LE(tree[static_cast<std::size_t>(order[i - 1])].key(),
              tree[static_cast<std::size_t>(order[i])].key());
  }
}

TEST(TreeNode, KeysAreThePostorder) {
  const TreeNode root;
  const TreeNode left = root.child(0), right = root.child(1);
  EXPECT_EQ(root.depth(), 0);
  EXPECT_EQ(left.child(1).depth(), 2);
  EXPECT_LT(left.child(0).key(), left.child(1).key());
  EXPECT_LT(left.child(1).key(), left.key());
  EXPECT_LT(left.key(), right.child(0).key());
  EXPECT_LT(right.key(), root.key());
  EXPECT_TRUE(on_one_branch(root, right.child(0)));
  EXPECT_TRUE(on_one_branch(left.child(1).child(0), left));
  EXPECT_FALSE(on_one_branch(left, right.child(0)));
  EXPECT_EQ(common_depth(left.child(0).child(1), left.child(1)), 1);
  EXPECT_TRUE(left.child(1).child(0).ancestor(1) == left);
  EXPECT_EQ(left.child(1).side_at(0), 0);
  EXPECT_EQ(left.child(1).side_at(1), 1);
  TreeNode deep = root;
  for (int d = 0; d < TreeNode::kDeepest; ++d) deep = deep.child(d & 1);
  EXPECT_EQ(deep.depth(), TreeNode::kDeepest);
  EXPECT_TRUE(on_one_branch(deep, root.child(0)));
  EXPECT_FALSE(on_one_branch(deep, root.child(1)));
}

TEST(DissectionTree, FreshAndRepairedOrdersSeparate) {
  ExecutionContext context;
  std::mt19937 random(1);
  FlippedGrid grid(60, 47);
  DissectionTree tree;
  std::vector<Index> order = nested_dissection(grid.graph(), nullptr, context, &tree);
  expect_dissected(grid.graph(), tree, order);
  for (int round = 0; round < 6; ++round) {
    grid.flip_share(round % 2 == 0 ? 0.02 : 0.4, random);
    order = repair_dissection(grid.graph(), order, tree, context);
    expect_dissected(grid.graph(), tree, order);
  }
}

TEST(DissectionTree, AnUnchangedGraphKeepsItsFactorSize) {
  ExecutionContext context;
  const SparseMatrix matrix = FlippedGrid(80, 80).laplacian();
  SparseCholesky solver;
  solver.analyze(matrix, context);
  const double before = solver.factor_flops();
  solver.analyze_again(matrix, context);
  EXPECT_LE(solver.factor_flops(), 1.02 * before);
}

TEST(DissectionTree, ManyFlipsLaterTheOrderIsAlmostAsGoodAsANewOneAndSolves) {
  ExecutionContext context;
  std::mt19937 random(7);
  FlippedGrid grid(90, 90);
  SparseCholesky repaired;
  repaired.analyze(grid.laplacian(), context);
  for (int round = 0; round < 8; ++round) {
    grid.flip_share(0.15, random);
    const SparseMatrix matrix = grid.laplacian();
    repaired.analyze_again(matrix, context);
    ASSERT_TRUE(repaired.factorize(matrix, context));
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(matrix.rows(), -1.0, 1.0);
    const Eigen::VectorXd x = repaired.solve(b, context);
    EXPECT_LT((matrix.selfadjointView<Eigen::Lower>() * x - b).norm(), 1e-9 * b.norm());
    SparseCholesky fresh;
    fresh.analyze(matrix, context);
    EXPECT_LT(repaired.factor_flops(), 1.6 * fresh.factor_flops()) << "round " << round;
  }
}

TEST(DissectionTree, AGraphThatBecomesQuiteAnotherIsStillSeparated) {
  ExecutionContext context;
  FlippedGrid grid(30, 30);
  DissectionTree tree;
  std::vector<Index> order = nested_dissection(grid.graph(), nullptr, context, &tree);
  // A long cycle in random order, and a star: nothing of the old neighbourhoods is left.
  const Index n = grid.graph().count();
  std::vector<Index> shuffled(static_cast<std::size_t>(n));
  std::iota(shuffled.begin(), shuffled.end(), 0);
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(3));
  std::vector<std::vector<Index>> near(static_cast<std::size_t>(n));
  const auto join = [&](Index a, Index b) {
    near[static_cast<std::size_t>(a)].push_back(b);
    near[static_cast<std::size_t>(b)].push_back(a);
  };
  for (std::size_t i = 1; i < shuffled.size(); ++i) {
    join(shuffled[i - 1], shuffled[i]);
    if (i > 1) join(shuffled[0], shuffled[i]);
  }
  Graph graph;
  graph.offset.push_back(0);
  for (const auto& list : near) {
    graph.neighbour.insert(graph.neighbour.end(), list.begin(), list.end());
    graph.offset.push_back(static_cast<Index>(graph.neighbour.size()));
  }
  order = repair_dissection(graph, order, tree, context);
  expect_dissected(graph, tree, order);
}

}  // namespace
}  // namespace flipfree::numeric::dissection_tree_test
