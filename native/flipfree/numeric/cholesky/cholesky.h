// Sparse Cholesky factorization that keeps its symbolic analysis. Symmetric positive definite
// matrices only.
//
// Approximate minimum degree, supernodes, multifrontal numeric phase: symbolic_cholesky.h,
// multifrontal.h. Of our own, because no library call can be cancelled within its largest front,
// and because the bits must not depend on the number of threads.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::numeric {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

class Multifrontal;

class SparseCholesky {
 public:
  SparseCholesky();
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  // Orders and analyses the pattern of `matrix`, n x n, of which the lower triangle is read;
  // compressed, sorted columns. The pattern is kept until the next call. Pairs of unknowns (2 i, 2
  // i + 1) that always occur together are found and handled as one.
  void analyze(const SparseMatrix& matrix, ExecutionContext& context);

  // Numeric factorization of a matrix with exactly the analysed pattern. False if it is not
  // positive definite to working precision (the factor is then unusable until the next success).
  // Same bits for any number of threads. Reports progress over the context's current range.
  [[nodiscard]] bool factorize(const SparseMatrix& matrix, ExecutionContext& context);

  // Solves A X = B; B is n x k. Requires a successful factorize().
  Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs,
                        ExecutionContext& context) const;

 private:
  std::unique_ptr<Multifrontal> numeric_;  // null: nothing is analysed
  Index unknowns_ = 0;
  bool factorized_ = false;
};

}  // namespace flipfree::numeric
