// Solving with the factor: columns at once, blocks of any size, narrow and wide fronts, tasks.
#include "flipfree/numeric/cholesky/multifrontal.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "numeric/cholesky/systems.h"
#include "support/graphs.h"

namespace flipfree::numeric::multifrontal_solve_test {
namespace {

using test::plan;
using test::random_system;
using test::System;

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

TEST(MultifrontalSolve, unit_vectors_give_a_symmetric_inverse) {
  std::mt19937 random(3);
  const System system = random_system(flipfree::test::random_graph(25, 50, random), 1, random);
  ExecutionContext context;
  Multifrontal factor = plan(system);
  ASSERT_TRUE(factor.factorize(system.matrix.valuePtr(), context));
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(25, 25);
  factor.solve(inverse.data(), 25, context);
  const Eigen::MatrixXd dense = Eigen::MatrixXd(system.matrix).selfadjointView<Eigen::Lower>();
  EXPECT_LT((inverse - dense.inverse()).norm(), 1e-11);
}

}  // namespace
}  // namespace flipfree::numeric::multifrontal_solve_test
