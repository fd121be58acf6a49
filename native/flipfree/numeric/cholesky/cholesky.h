// Sparse Cholesky factorization that keeps its symbolic analysis. Symmetric positive definite
// matrices only.
//
// Nested dissection, supernodes, multifrontal numeric phase: nested_dissection.h,
// symbolic_cholesky.h, multifrontal.h. Of our own, because no library call can be cancelled within
// its largest front or ordering, and because the bits must not depend on the number of threads.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/numeric/cholesky/elimination_memory.h"

namespace flipfree::numeric {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

class SparseCholesky {
 public:
  SparseCholesky();
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  // Orders and analyses the pattern of `matrix`, n x n, of which the lower triangle is read;
  // compressed, sorted columns. The pattern is kept until the next call. Pairs of unknowns (2 i, 2
  // i + 1) that always occur together are found and handled as one. `places`, if given, is a rough
  // planar drawing of the unknowns (n x 2) or of those pairs (n / 2 x 2): it speeds the ordering up
  // and has no influence on correctness.
  void analyze(const SparseMatrix& matrix, ExecutionContext& context,
               const Points2* places = nullptr);
  // The same for another pattern of the same size, in the elimination order of the last analysis,
  // repaired where it separates no more (dissection_tree.h): for patterns that changed in a few
  // places, where a new order would cost more than it saves.
  void analyze_again(const SparseMatrix& matrix, ExecutionContext& context);
  // As analyze(), from the order that `memory` has of a graph with nearly the same vertices, and
  // puts this one there. Vertex v of the graph (an unknown, or a pair) has the label label[v],
  // ascending; without pairs where labels are of pairs, the memory is left alone.
  void analyze(const SparseMatrix& matrix, ExecutionContext& context, const Points2* places,
               EliminationMemory& memory, const std::vector<Index>& label);
  bool analyzed() const;

  // Numeric factorization of a matrix with exactly the analysed pattern. False if it is not
  // positive definite to working precision (the factor is then unusable until the next success).
  // Same bits for any number of threads. Reports progress over the context's current range.
  [[nodiscard]] bool factorize(const SparseMatrix& matrix, ExecutionContext& context);

  // Solves A X = B; B is n x k. Requires a successful factorize().
  Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs,
                        ExecutionContext& context) const;

  // Nonzeros of the factor predicted by the analysis, and the flops of one factorization.
  std::int64_t factor_nonzeros() const;
  double factor_flops() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace flipfree::numeric
