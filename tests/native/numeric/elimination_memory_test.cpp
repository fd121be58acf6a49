// Elimination orders carried from one mesh to the next: correct whatever is remembered, and nearly
// as good as new ones.
#include "flipfree/numeric/cholesky/cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <random>
#include <vector>

namespace flipfree::numeric::elimination_memory_test {
namespace {

constexpr Index kSide = 60;

// Laplacian plus one of a triangulated square grid without some of its vertices; `label` receives
// the grid's number of each vertex that is left.
SparseMatrix grid_without(const std::vector<char>& gone, std::vector<Index>& label) {
  std::vector<Index> number(static_cast<std::size_t>(kSide * kSide), kInvalid);
  label.clear();
  for (Index v = 0; v < kSide * kSide; ++v) {
    if (gone[static_cast<std::size_t>(v)] != 0) continue;
    number[static_cast<std::size_t>(v)] = static_cast<Index>(label.size());
    label.push_back(v);
  }
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (const Index v : label) {
    const Index i = number[static_cast<std::size_t>(v)];
    entries.emplace_back(i, i, 7.0);
    const Index x = v % kSide;
    const Index y = v / kSide;
    const auto join = [&](bool there, Index w) {
      if (!there || number[static_cast<std::size_t>(w)] == kInvalid) return;
      entries.emplace_back(number[static_cast<std::size_t>(w)], i, -1.0);
    };
    join(x + 1 < kSide, v + 1);
    join(y + 1 < kSide, v + kSide);
    join(x + 1 < kSide && y + 1 < kSide, v + kSide + 1);
  }
  const auto n = static_cast<Eigen::Index>(label.size());
  SparseMatrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

std::vector<char> some_gone(double share, unsigned seed) {
  std::mt19937 random(seed);
  std::bernoulli_distribution coin(share);
  std::vector<char> gone;
  for (Index v = 0; v < kSide * kSide; ++v) gone.push_back(coin(random) ? 1 : 0);
  return gone;
}

double residual(const SparseMatrix& lower, SparseCholesky& cholesky, ExecutionContext& context) {
  if (!cholesky.factorize(lower, context)) return 1e300;
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(lower.rows(), -1.0, 2.0);
  const Eigen::VectorXd x = cholesky.solve(right, context);
  return (lower.selfadjointView<Eigen::Lower>() * x - right).norm();
}

TEST(EliminationMemory, OrdersMeshesWhoseVerticesComeAndGoNearlyAsWellAsSearching) {
  ExecutionContext context;
  EliminationMemory memory;
  std::vector<Index> label;
  int used = 0;
  for (unsigned round = 0; round < 8; ++round) {
    const SparseMatrix matrix = grid_without(some_gone(0.1, round), label);
    SparseCholesky remembered;
    remembered.analyze(matrix, context, nullptr, memory, label);
    SparseCholesky searched;
    searched.analyze(matrix, context);
    EXPECT_LT(residual(matrix, remembered, context), 1e-9);
    EXPECT_LT(remembered.factor_flops(), 2.0 * searched.factor_flops()) << "round " << round;
    if (remembered.factor_flops() != searched.factor_flops()) ++used;
  }
  EXPECT_GE(used, 4) << "nothing was remembered";
}

}  // namespace
}  // namespace flipfree::numeric::elimination_memory_test
