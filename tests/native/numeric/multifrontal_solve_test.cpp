// Solving with the factor: columns at once, blocks of any size, narrow and wide fronts, tasks.
#include "flipfree/numeric/cholesky/multifrontal.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "flipfree/numeric/cholesky/cholesky.h"
#include "support/graphs.h"

namespace flipfree::numeric::multifrontal_solve_test {
namespace {

using Triplets = std::vector<Eigen::Triplet<double, Index>>;

struct System {
  SparseMatrix matrix;  // lower triangle
  Graph graph;
  Index block = 1;
};

// Diagonally dominant, coupled as the graph says, `block` unknowns a vertex.
System random_system(const Graph& graph, Index block, std::mt19937& random) {
  std::uniform_real_distribution<double> weight(-1.0, 1.0);
  const Index n = block * graph.count();
  Triplets entries;
  std::vector<double> sum(static_cast<std::size_t>(n), 0.1);
  const auto couple = [&](Index i, Index j) {
    const double w = weight(random);
    entries.emplace_back(i, j, w);
    sum[static_cast<std::size_t>(i)] += std::abs(w);
    sum[static_cast<std::size_t>(j)] += std::abs(w);
  };
  for (Index v = 0; v < graph.count(); ++v) {
    for (Index k = 0; k < block; ++k) {
      for (Index l = 0; l < k; ++l) couple(block * v + k, block * v + l);
    }
    for (Index i = graph.offset[static_cast<std::size_t>(v)];
         i < graph.offset[static_cast<std::size_t>(v) + 1]; ++i) {
      const Index u = graph.neighbour[static_cast<std::size_t>(i)];
      if (u > v) continue;
      for (Index k = 0; k < block; ++k) {
        for (Index l = 0; l < block; ++l) couple(block * v + k, block * u + l);
      }
    }
  }
  for (Index i = 0; i < n; ++i) entries.emplace_back(i, i, sum[static_cast<std::size_t>(i)]);
  System system;
  system.matrix.resize(n, n);
  system.matrix.setFromTriplets(entries.begin(), entries.end());
  system.graph = graph;
  system.block = block;
  return system;
}

Multifrontal plan(const System& system, FactorMemory memory = {}) {
  const ExecutionContext context;
  return Multifrontal(analyze_supernodes(system.graph, context), system.block,
                      static_cast<Index>(system.matrix.rows()), system.matrix.outerIndexPtr(),
                      system.matrix.innerIndexPtr(), context, std::move(memory));
}

TEST(MultifrontalSolve, columns_at_once_are_the_columns_one_by_one) {
  std::mt19937 random(1);
  for (const Index block : {1, 2, 3}) {
    const System system = random_system(flipfree::test::lattice(14, 11), block, random);
    ExecutionContext context;
    Multifrontal factor = plan(system);
    ASSERT_TRUE(factor.factorize(system.matrix.valuePtr(), context));
    const Index n = static_cast<Index>(system.matrix.rows());
    for (const Index count : {1, 2, 5}) {
      Eigen::MatrixXd x(n, count);
      for (Index k = 0; k < count; ++k) x.col(k) = Eigen::VectorXd::LinSpaced(n, -1.0, k);
      const Eigen::MatrixXd rhs = x;
      factor.solve(x.data(), count, context);
      const Eigen::MatrixXd back = system.matrix.selfadjointView<Eigen::Lower>() * x;
      EXPECT_LT((back - rhs).norm(), 1e-11 * rhs.norm());
    }
  }
}

// Fronts of many columns go another way than narrow ones, subtrees of their own another than what
// stands above them.
TEST(MultifrontalSolve, wide_fronts_and_many_tasks_are_solved_as_well) {
  std::mt19937 random(2);
  std::set<std::pair<Index, Index>> pairs;
  for (Index v = 1; v < 200; ++v) {
    for (Index u = 0; u < v; ++u) pairs.emplace(u, v);
  }
  const Graph clique = flipfree::test::graph_of(200, pairs);
  for (const Graph& graph : {clique, flipfree::test::lattice(120, 110)}) {
    const System system = random_system(graph, 2, random);
    ExecutionContext context;
    Multifrontal factor = plan(system);
    ASSERT_TRUE(factor.factorize(system.matrix.valuePtr(), context));
    for (const Index count : {1, 3}) {
      Eigen::MatrixXd x = Eigen::MatrixXd::Constant(system.matrix.rows(), count, 1.0);
      const Eigen::MatrixXd rhs = x;
      factor.solve(x.data(), count, context);
      const Eigen::MatrixXd back = system.matrix.selfadjointView<Eigen::Lower>() * x;
      EXPECT_LT((back - rhs).norm(), 1e-10 * rhs.norm());
    }
  }
}

}  // namespace
}  // namespace flipfree::numeric::multifrontal_solve_test
