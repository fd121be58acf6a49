// What the plan says before there are numbers, and where it puts the numbers.
#include "flipfree/numeric/cholesky/multifrontal.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "numeric/cholesky/systems.h"
#include "support/graphs.h"

namespace flipfree::numeric::multifrontal_plan_test {
namespace {

using test::plan;
using test::random_system;
using test::System;

// Every entry of the matrix is put into one place of one front: a matrix with one entry changed
// has another solution, that of the changed matrix.
TEST(MultifrontalPlan, every_entry_of_the_matrix_counts_once) {
  std::mt19937 random(1);
  const System system = random_system(flipfree::test::random_graph(18, 40, random), 2, random);
  Multifrontal factor = plan(system);
  ExecutionContext context;
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(36, 1.0, 2.0);
  for (Index e = 0; e < system.matrix.nonZeros(); ++e) {
    SparseMatrix changed = system.matrix;
    changed.valuePtr()[e] *= 1.01;
    ASSERT_TRUE(factor.factorize(changed.valuePtr(), context));
    Eigen::VectorXd x = rhs;
    factor.solve(x.data(), 1, context);
    const Eigen::VectorXd back = changed.selfadjointView<Eigen::Lower>() * x;
    EXPECT_LT((back - rhs).norm(), 1e-11) << "entry " << e;
  }
}

TEST(MultifrontalPlan, entries_above_the_diagonal_are_skipped) {
  std::mt19937 random(2);
  System system = random_system(flipfree::test::lattice(5, 4), 2, random);
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(40, 1.0, 2.0);
  ExecutionContext context;
  const auto solution = [&] {
    Multifrontal factor = plan(system);
    EXPECT_TRUE(factor.factorize(system.matrix.valuePtr(), context));
    Eigen::VectorXd x = rhs;
    factor.solve(x.data(), 1, context);
    return x;
  };
  const Eigen::VectorXd expected = solution();
  SparseMatrix full;
  full = system.matrix.selfadjointView<Eigen::Lower>();
  for (Index j = 0; j < 40; ++j) {
    for (SparseMatrix::InnerIterator entry(full, j); entry; ++entry) {
      if (entry.row() < entry.col()) entry.valueRef() = 1e9;
    }
  }
  system.matrix = full;
  EXPECT_EQ(solution(), expected);
}

TEST(MultifrontalPlan, counts_at_least_the_entries_of_the_factor) {
  std::mt19937 random(3);
  for (int i = 0; i < 30; ++i) {
    const Index block = 1 + i % 2;
    const System system =
        random_system(flipfree::test::random_graph(60, 150, random), block, random);
    const Multifrontal factor = plan(system);
    const std::int64_t n = system.matrix.rows();
    EXPECT_GE(factor.factor_nonzeros(), system.matrix.nonZeros());
    EXPECT_LE(factor.factor_nonzeros(), n * (n + 1) / 2);
    EXPECT_GT(factor.flops(), static_cast<double>(n));
  }
  // A clique has no choice: the whole triangle, n^3 / 3 flops and what follows it.
  std::set<std::pair<Index, Index>> pairs;
  for (Index v = 1; v < 90; ++v) {
    for (Index u = 0; u < v; ++u) pairs.emplace(u, v);
  }
  const Multifrontal clique = plan(random_system(flipfree::test::graph_of(90, pairs), 1, random));
  EXPECT_EQ(clique.factor_nonzeros(), 90 * 91 / 2);
  EXPECT_NEAR(clique.flops(), 90.0 * 90.0 * 90.0 / 3.0, 0.25 * clique.flops());
}

TEST(DoubleBuffer, provides_what_is_asked_for_and_keeps_it_while_that_fits) {
  DoubleBuffer buffer;
  double* first = buffer.provide(10);
  for (int i = 0; i < 10; ++i) first[i] = i;
  EXPECT_EQ(buffer.provide(10), first);
  EXPECT_EQ(buffer.provide(3), first);
  EXPECT_EQ(first[9], 9.0);
  double* more = buffer.provide(100000);
  for (int i = 0; i < 100000; ++i) more[i] = i;
  DoubleBuffer moved = std::move(buffer);
  EXPECT_EQ(moved.get(), more);
  EXPECT_EQ(moved.provide(100000)[99999], 99999.0);
  double* anew = buffer.provide(5);  // NOLINT: what was moved from begins anew
  anew[4] = 1.0;
  EXPECT_NE(anew, more);
}

}  // namespace
}  // namespace flipfree::numeric::multifrontal_plan_test
