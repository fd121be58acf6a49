// CHOLMOD, another author's factorization, as the judge of ours: the same solutions, and the same
// matrices called not positive definite.
#include <cholmod.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/numeric/cholesky/cholesky.h"
#include "support/shapes.h"

namespace flipfree::numeric::cholesky_test {
namespace {

using Triplets = std::vector<Eigen::Triplet<double, Index>>;

class Cholmod {
 public:
  explicit Cholmod(const SparseMatrix& lower) {
    cholmod_start(&common_);
    common_.print = 0;
    common_.supernodal = CHOLMOD_SUPERNODAL;  // L L^T: the other way takes indefinite ones too
    matrix_.nrow = matrix_.ncol = static_cast<std::size_t>(lower.rows());
    matrix_.nzmax = static_cast<std::size_t>(lower.nonZeros());
    matrix_.p = const_cast<Index*>(lower.outerIndexPtr());
    matrix_.i = const_cast<Index*>(lower.innerIndexPtr());
    matrix_.x = const_cast<double*>(lower.valuePtr());
    matrix_.stype = -1;
    matrix_.itype = CHOLMOD_INT;
    matrix_.xtype = CHOLMOD_REAL;
    matrix_.dtype = CHOLMOD_DOUBLE;
    matrix_.sorted = matrix_.packed = 1;
    factor_ = cholmod_analyze(&matrix_, &common_);
    cholmod_factorize(&matrix_, factor_, &common_);
  }
  ~Cholmod() {
    cholmod_free_factor(&factor_, &common_);
    cholmod_finish(&common_);
  }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;

  bool positive_definite() const { return common_.status == CHOLMOD_OK; }
  Eigen::VectorXd solve(Eigen::VectorXd rhs) {
    cholmod_dense b{};
    b.nrow = b.nzmax = b.d = static_cast<std::size_t>(rhs.size());
    b.ncol = 1;
    b.x = rhs.data();
    b.xtype = CHOLMOD_REAL;
    b.dtype = CHOLMOD_DOUBLE;
    cholmod_dense* x = cholmod_solve(CHOLMOD_A, factor_, &b, &common_);
    const Eigen::VectorXd solution =
        Eigen::Map<const Eigen::VectorXd>(static_cast<const double*>(x->x), rhs.size());
    cholmod_free_dense(&x, &common_);
    return solution;
  }

 private:
  cholmod_common common_{};
  cholmod_sparse matrix_{};
  cholmod_factor* factor_ = nullptr;
};

SparseMatrix build(Index n, const Triplets& entries) {
  SparseMatrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Lower triangle of the cotangent Laplacian plus `shift` times the identity.
SparseMatrix laplacian(const mesh::Surface& surface, double shift) {
  Triplets entries;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      const VertexId a = surface.faces(f, k), b = surface.faces(f, (k + 1) % 3),
                     c = surface.faces(f, (k + 2) % 3);
      const Vector3 u = surface.vertices.row(a) - surface.vertices.row(c);
      const Vector3 v = surface.vertices.row(b) - surface.vertices.row(c);
      const double cosine = u.dot(v);
      const double weight =
          0.5 * cosine / std::sqrt(u.squaredNorm() * v.squaredNorm() - cosine * cosine);
      entries.emplace_back(a, a, weight);
      entries.emplace_back(b, b, weight);
      entries.emplace_back(std::max(a, b), std::min(a, b), -weight);
    }
  }
  const auto n = static_cast<Index>(surface.vertices.rows());
  for (Index i = 0; i < n; ++i) entries.emplace_back(i, i, shift);
  return build(n, entries);
}

// A random pattern, also with columns that are nearly full; positive definite by its diagonal if
// `dominance` is above 1.
SparseMatrix random_matrix(Index n, int couplings, double dominance, std::mt19937& random) {
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  std::vector<double> row_sum(static_cast<std::size_t>(n), 0.1);
  Triplets entries;
  for (int e = 0; e < couplings; ++e) {
    const auto a = static_cast<Index>(random() % static_cast<unsigned>(n));
    const auto b = random() % 8 == 0 ? 0 : static_cast<Index>(random() % static_cast<unsigned>(n));
    if (a == b) continue;
    const double w = value(random);
    entries.emplace_back(std::max(a, b), std::min(a, b), w);
    row_sum[static_cast<std::size_t>(a)] += std::abs(w);
    row_sum[static_cast<std::size_t>(b)] += std::abs(w);
  }
  for (Index i = 0; i < n; ++i)
    entries.emplace_back(i, i, dominance * row_sum[static_cast<std::size_t>(i)]);
  return build(n, entries);
}

// `condition`: a bound of the matrix' condition number, by which rounding errors may grow.
void expect_same(const SparseMatrix& matrix, double condition) {
  ExecutionContext context;
  SparseCholesky ours;
  ours.analyze(matrix, context);
  Cholmod theirs(matrix);
  ASSERT_TRUE(ours.factorize(matrix, context));
  ASSERT_TRUE(theirs.positive_definite());
  std::srand(7);
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Random(matrix.rows(), 3);
  const Eigen::MatrixXd x = ours.solve(rhs, context);
  for (Eigen::Index k = 0; k < rhs.cols(); ++k) {
    const Eigen::VectorXd y = theirs.solve(rhs.col(k));
    EXPECT_LT((x.col(k) - y).norm(), 1e-14 * condition * y.norm());
    EXPECT_LT((ours.solve(rhs.col(k), context) - y).norm(), 1e-14 * condition * y.norm());
  }
}

TEST(CholmodOracle, LaplaciansOfMeshesHaveTheSameSolutions) {
  for (const mesh::Surface& surface :
       {test::bumpy_grid(60, 45, 0.3, 3.0), test::sphere(50, 40), test::torus(48, 30),
        test::of_cubes(test::plate(3), 4), test::tube(8, 300)})
    for (const double shift : {1e-6, 1e-2, 10.0})
      expect_same(laplacian(surface, shift), 50.0 / shift);
}

TEST(CholmodOracle, RandomPatternsHaveTheSameSolutions) {
  std::mt19937 random(5);
  for (int round = 0; round < 60; ++round) {
    const auto n = static_cast<Index>(1 + random() % 400);
    const auto couplings = static_cast<int>(random() % static_cast<unsigned>(4 * n));
    expect_same(random_matrix(n, couplings, 1.5, random), 1e4);
  }
  expect_same(random_matrix(400, 400 * 400, 1.5, random), 1e4);  // one wide front
}

TEST(CholmodOracle, TheSameMatricesAreNotPositiveDefinite) {
  std::mt19937 random(6);
  ExecutionContext context;
  int refused = 0;
  for (int round = 0; round < 200; ++round) {
    const auto n = static_cast<Index>(2 + random() % 120);
    const double dominance = std::uniform_real_distribution<double>(0.1, 1.2)(random);
    const SparseMatrix matrix = random_matrix(n, static_cast<int>(3 * n), dominance, random);
    SparseCholesky ours;
    ours.analyze(matrix, context);
    const bool accepted = ours.factorize(matrix, context);
    EXPECT_EQ(accepted, Cholmod(matrix).positive_definite());
    refused += accepted ? 0 : 1;
  }
  EXPECT_GT(refused, 40);
  EXPECT_LT(refused, 160);
}

TEST(Cholesky, NumberOfThreadsDoesNotChangeABit) {
  const SparseMatrix matrix = laplacian(test::bumpy_grid(300, 300, 0.1, 3.0), 1e-2);
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Ones(matrix.rows(), 2);
  Eigen::MatrixXd first;
  for (const int threads : {1, 2, 3, 4}) {
    ExecutionContext context;
    context.threads = threads;
    SparseCholesky solver;
    solver.analyze(matrix, context);
    ASSERT_TRUE(solver.factorize(matrix, context));
    const Eigen::MatrixXd x = solver.solve(rhs, context);
    if (threads == 1) first = x;
    EXPECT_EQ(x, first);
  }
}

TEST(Cholesky, RefactorizesWithNewValuesIgnoresTheUpperTriangleAndRefusesIndefiniteOnes) {
  SparseMatrix matrix = laplacian(test::bumpy_grid(40, 40, 0.3, 3.0), 1e-2);
  ExecutionContext context;
  SparseCholesky solver;
  solver.analyze(matrix, context);
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Ones(matrix.rows(), 1);
  SparseMatrix bad = matrix;
  for (const double wrong : {-1.0, std::nan("")}) {
    bad.coeffRef(1000, 1000) = wrong;
    EXPECT_FALSE(solver.factorize(bad, context));
    EXPECT_THROW(solver.solve(rhs, context), InternalError);
  }
  matrix *= 3;
  ASSERT_TRUE(solver.factorize(matrix, context));
  const Eigen::MatrixXd x = solver.solve(rhs, context);
  const SparseMatrix full = matrix.selfadjointView<Eigen::Lower>();
  EXPECT_LT((full * x - rhs).norm(), 1e-11 * rhs.norm());
  SparseCholesky other;
  other.analyze(full, context);
  ASSERT_TRUE(other.factorize(full, context));
  EXPECT_EQ(other.solve(rhs, context), x);
}

TEST(Cholesky, CancelFromAnotherThreadEndsAnalysisAndFactorization) {
  const SparseMatrix matrix = laplacian(test::bumpy_grid(250, 250, 0.1, 3.0), 1e-2);
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
