#include "flipfree/numeric/cholesky/cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <chrono>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "flipfree/base/error.h"

namespace flipfree::numeric::cholesky_test {
namespace {

using Triplets = std::vector<Eigen::Triplet<double, Index>>;

SparseMatrix build(Index n, const Triplets& entries) {
  SparseMatrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Laplacian of a triangulated grid with random weights, `block` unknowns per vertex coupled by
// random SPD blocks; lower triangle only.
SparseMatrix grid_matrix(Index columns, Index rows, Index block, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> weight(0.1, 2.0);
  Triplets entries;
  const auto couple = [&](Index a, Index b) {
    for (Index k = 0; k < block; ++k) {
      const double w = weight(random);
      entries.emplace_back(block * a + k, block * a + k, w);
      entries.emplace_back(block * b + k, block * b + k, w);
      for (Index l = 0; l < block; ++l) {
        const double off = k == l ? -w : 0.02 * w;
        entries.emplace_back(block * std::max(a, b) + k, block * std::min(a, b) + l, off);
        if (k != l) {
          entries.emplace_back(block * a + k, block * a + k, 0.03 * w);
          entries.emplace_back(block * b + l, block * b + l, 0.03 * w);
        }
      }
    }
  };
  for (Index y = 0; y < rows; ++y) {
    for (Index x = 0; x < columns; ++x) {
      const Index v = y * columns + x;
      for (Index k = 0; k < block; ++k) {
        entries.emplace_back(block * v + k, block * v + k, 1e-3);
        for (Index l = 0; l < k; ++l) entries.emplace_back(block * v + k, block * v + l, 1e-5);
      }
      if (x + 1 < columns) couple(v, v + 1);
      if (y + 1 < rows) couple(v, v + columns);
      if (x + 1 < columns && y + 1 < rows) couple(v, v + columns + 1);
    }
  }
  return build(block * columns * rows, entries);
}

double residual(const SparseMatrix& lower, const Eigen::MatrixXd& x, const Eigen::MatrixXd& b) {
  const Eigen::MatrixXd product = lower.selfadjointView<Eigen::Lower>() * x;
  return (product - b).norm() / b.norm();
}

void expect_solves(const SparseMatrix& matrix, const Points2* places = nullptr) {
  ExecutionContext context;
  SparseCholesky solver;
  solver.analyze(matrix, context, places);
  ASSERT_TRUE(solver.factorize(matrix, context));
  for (const Index count : {1, 2, 3}) {
    std::srand(1);
    const Eigen::MatrixXd b = Eigen::MatrixXd::Random(matrix.rows(), count);
    EXPECT_LT(residual(matrix, solver.solve(b, context), b), 1e-11);
  }
}

TEST(Cholesky, SolvesGridsOfAllBlockSizesWithAndWithoutPlaces) {
  for (const Index block : {1, 2, 3}) {
    const Index n = 70;
    expect_solves(grid_matrix(n, n, block, 1));
    Points2 places(n * n, 2);
    for (Index v = 0; v < n * n; ++v) places.row(v) << v % n, v / n;
    if (block != 3) expect_solves(grid_matrix(n, n, block, 1), &places);
  }
}

TEST(Cholesky, SolvesMatricesThatAreNotMeshes) {
  expect_solves(build(1, {{0, 0, 4.0}}));
  // Diagonal: a graph without edges.
  Triplets diagonal;
  for (Index i = 0; i < 500; ++i) diagonal.emplace_back(i, i, 1.0 + i);
  expect_solves(build(500, diagonal));
  // A star and a clique: no balanced separator.
  Triplets star;
  for (Index i = 0; i < 500; ++i) star.emplace_back(i, i, i == 0 ? 501.0 : 2.0);
  for (Index i = 1; i < 500; ++i) star.emplace_back(i, 0, -1.0);
  expect_solves(build(500, star));
  Triplets clique;
  for (Index i = 0; i < 300; ++i) {
    for (Index j = 0; j < i; ++j) clique.emplace_back(i, j, -1.0);
    clique.emplace_back(i, i, 301.0);
  }
  expect_solves(build(300, clique));
  // A path, and many components of different sizes.
  Triplets chains;
  for (Index i = 0; i < 2000; ++i) {
    chains.emplace_back(i, i, 2.5);
    if (i > 0 && i % 37 != 0 && i < 900) chains.emplace_back(i, i - 1, -1.0);
    if (i > 900) chains.emplace_back(i, i - 1, -1.0);
  }
  expect_solves(build(2000, chains));
  // Random sparse, diagonally dominant.
  std::mt19937 random(3);
  Triplets sparse;
  for (Index i = 0; i < 1500; ++i) sparse.emplace_back(i, i, 20.0);
  for (int e = 0; e < 3000; ++e) {
    const auto a = static_cast<Index>(random() % 1500);
    const auto b = static_cast<Index>(random() % 1500);
    if (a != b) sparse.emplace_back(std::max(a, b), std::min(a, b), -0.5);
  }
  expect_solves(build(1500, sparse));
}

TEST(Cholesky, IgnoresTheUpperTriangle) {
  const SparseMatrix lower = grid_matrix(20, 20, 2, 5);
  const SparseMatrix full = lower.selfadjointView<Eigen::Lower>();
  ExecutionContext context;
  SparseCholesky a;
  SparseCholesky b;
  a.analyze(lower, context);
  b.analyze(full, context);
  ASSERT_TRUE(a.factorize(lower, context));
  ASSERT_TRUE(b.factorize(full, context));
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Ones(lower.rows(), 1);
  EXPECT_EQ(a.solve(rhs, context), b.solve(rhs, context));
}

TEST(Cholesky, AgreesWithASecondImplementation) {
  const SparseMatrix matrix = grid_matrix(60, 45, 2, 11);
  ExecutionContext context;
  SparseCholesky solver;
  solver.analyze(matrix, context);
  ASSERT_TRUE(solver.factorize(matrix, context));
  const Eigen::SimplicialLLT<SparseMatrix> other(matrix);
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(matrix.rows(), -1, 2);
  const Eigen::VectorXd expected = other.solve(rhs);
  EXPECT_LT((solver.solve(rhs, context) - expected).norm(), 1e-10 * expected.norm());
  EXPECT_LT(static_cast<double>(solver.factor_nonzeros()),
            1.5 * static_cast<double>(SparseMatrix(other.matrixL()).nonZeros()));
}

TEST(Cholesky, NumberOfThreadsDoesNotChangeABit) {
  const SparseMatrix matrix = grid_matrix(300, 300, 2, 2);
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Ones(matrix.rows(), 2);
  Eigen::MatrixXd results[4];
  for (int threads = 1; threads <= 4; ++threads) {
    ExecutionContext context;
    context.threads = threads;
    SparseCholesky solver;
    solver.analyze(matrix, context);
    ASSERT_TRUE(solver.factorize(matrix, context));
    results[threads - 1] = solver.solve(rhs, context);
  }
  for (int i = 1; i < 4; ++i) EXPECT_EQ(results[0], results[i]);
}

TEST(Cholesky, RefactorizesWithNewValuesAndRefusesIndefiniteOnes) {
  SparseMatrix matrix = grid_matrix(40, 40, 2, 2);
  ExecutionContext context;
  SparseCholesky solver;
  solver.analyze(matrix, context);
  ASSERT_TRUE(solver.factorize(matrix, context));
  SparseMatrix bad = matrix;
  bad.coeffRef(1000, 1000) = -1;
  EXPECT_FALSE(solver.factorize(bad, context));
  EXPECT_THROW(solver.solve(Eigen::MatrixXd::Ones(matrix.rows(), 1), context), InternalError);
  bad.coeffRef(1000, 1000) = std::nan("");
  EXPECT_FALSE(solver.factorize(bad, context));
  matrix *= 3;
  ASSERT_TRUE(solver.factorize(matrix, context));
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Ones(matrix.rows(), 1);
  EXPECT_LT(residual(matrix, solver.solve(rhs, context), rhs), 1e-11);
}

TEST(Cholesky, CancelFromAnotherThreadEndsAnalysisAndFactorization) {
  const SparseMatrix matrix = grid_matrix(250, 250, 2, 2);
  for (const int milliseconds : {0, 5, 20, 60}) {
    ExecutionContext context;
    SparseCholesky solver;
    std::jthread canceller([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
      context.cancel();
    });
    try {
      solver.analyze(matrix, context);
      for (;;) {
        if (!solver.factorize(matrix, context)) FAIL() << "the matrix is positive definite";
      }
    } catch (const Cancelled&) {
    }
    // The same solver works afterwards.
    ExecutionContext fresh;
    solver.analyze(matrix, fresh);
    ASSERT_TRUE(solver.factorize(matrix, fresh));
  }
}

}  // namespace
}  // namespace flipfree::numeric::cholesky_test
