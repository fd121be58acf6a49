#include "flipfree/numeric/cholesky/multifrontal.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "flipfree/base/error.h"
#include "flipfree/numeric/dense_factors.h"
#include "numeric/cholesky/systems.h"
#include "support/graphs.h"

namespace flipfree::numeric::multifrontal_test {
namespace {

using test::plan;
using test::random_system;
using test::System;

// The determinant is the product of all pivots, the solution needs all of the factor: both against
// a dense factorization.
TEST(Multifrontal, factors_what_a_dense_factorization_factors) {
  std::mt19937 random(1);
  for (int i = 0; i < 60; ++i) {
    const Index block = 1 + i % 3;
    const Index n = 1 + static_cast<Index>(random() % 120);
    const System system =
        random_system(flipfree::test::random_graph(
                          n, static_cast<int>(random() % (3 * static_cast<unsigned>(n))), random),
                      block, random);
    ExecutionContext context;
    Multifrontal factor = plan(system);
    ASSERT_TRUE(factor.factorize(system.matrix.valuePtr(), context));
    const Eigen::MatrixXd dense = Eigen::MatrixXd(system.matrix).selfadjointView<Eigen::Lower>();
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(dense.rows(), -1.0, 2.0);
    const Eigen::VectorXd expected = solve_symmetric(dense, x);
    factor.solve(x.data(), 1, context);
    EXPECT_LT((x - expected).norm(), 1e-11 * expected.norm());
  }
}

TEST(Multifrontal, positive_definite_is_what_a_dense_factorization_says) {
  std::mt19937 random(2);
  int refused = 0;
  for (int i = 0; i < 200; ++i) {
    System system = random_system(flipfree::test::lattice(6, 5), 1 + i % 2, random);
    // Shifted until some have a negative eigenvalue; never close to zero.
    const Eigen::MatrixXd dense = Eigen::MatrixXd(system.matrix).selfadjointView<Eigen::Lower>();
    const Eigen::VectorXd eigen = symmetric_eigen(dense).values;
    const double shift = i % 2 == 0 ? 0.5 * eigen[0] : 0.5 * (eigen[0] + eigen[1]);
    if (eigen[1] - eigen[0] < 1e-6) continue;
    for (Index k = 0; k < system.matrix.rows(); ++k) system.matrix.coeffRef(k, k) -= shift;
    ExecutionContext context;
    EXPECT_EQ(plan(system).factorize(system.matrix.valuePtr(), context), i % 2 == 0);
    refused += i % 2;
  }
  EXPECT_GT(refused, 50);
}

TEST(Multifrontal, bits_depend_neither_on_threads_nor_on_memory_that_was_used_before) {
  std::mt19937 random(3);
  // Large enough for tasks, tiles and what stands above them.
  const System system = random_system(flipfree::test::lattice(150, 130), 2, random);
  const System before = random_system(flipfree::test::lattice(100, 100), 2, random);
  std::vector<Eigen::VectorXd> solutions;
  FactorMemory used;
  {
    ExecutionContext context;
    Multifrontal factor = plan(before);
    ASSERT_TRUE(factor.factorize(before.matrix.valuePtr(), context));
    used = factor.take_memory();
  }
  for (const int threads : {1, 2, 3}) {
    ExecutionContext context;
    context.threads = threads;
    Multifrontal factor = plan(system, std::move(used));
    for (int twice = 0; twice < 2; ++twice) {
      ASSERT_TRUE(factor.factorize(system.matrix.valuePtr(), context));
      Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(system.matrix.rows(), -1.0, 2.0);
      factor.solve(x.data(), 1, context);
      solutions.push_back(x);
    }
    used = {};
  }
  for (const Eigen::VectorXd& x : solutions) EXPECT_EQ(x, solutions[0]);
}

TEST(Multifrontal, a_cancelled_factorization_ends_and_progress_ends_at_one) {
  std::mt19937 random(4);
  const System system = random_system(flipfree::test::lattice(20, 20), 1, random);
  Multifrontal factor = plan(system);
  ExecutionContext context;
  ASSERT_TRUE(factor.factorize(system.matrix.valuePtr(), context));
  EXPECT_NEAR(context.fraction(), 1.0, 1e-9);
  context.cancel();
  EXPECT_THROW(factor.factorize(system.matrix.valuePtr(), context), Cancelled);
}

}  // namespace
}  // namespace flipfree::numeric::multifrontal_test
