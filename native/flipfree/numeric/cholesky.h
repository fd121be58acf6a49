// Sparse Cholesky factorization that keeps its symbolic analysis (SuiteSparse/CHOLMOD: Chen, Davis,
// Hager, Rajamanickam 2008). Symmetric positive definite matrices only.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

class SparseCholesky {
 public:
  SparseCholesky();
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  // Orders (METIS or AMD, whichever predicts less fill) and analyses the pattern of `matrix`, n x
  // n, of which the lower triangle is read; compressed, sorted columns. The pattern is kept until
  // the next call.
  void analyze(const SparseMatrix& matrix, ExecutionContext& context);
  bool analyzed() const;

  // Numeric factorization of a matrix with exactly the analysed pattern. False if it is not
  // positive definite to working precision (the factor is then unusable until the next success).
  // Same bits for any number of threads.
  [[nodiscard]] bool factorize(const SparseMatrix& matrix, ExecutionContext& context);

  // Solves A X = B; B is n x k. Requires a successful factorize().
  Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs,
                        ExecutionContext& context) const;

  // Nonzeros of the factor predicted by the analysis.
  std::int64_t factor_nonzeros() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace flipfree
