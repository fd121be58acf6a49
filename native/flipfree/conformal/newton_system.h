// The Newton direction: cotan Laplacian of the current triangulation, factorized by
// numeric/cholesky/cholesky.h, refined in double.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/numeric/cholesky/cholesky.h"
#include "flipfree/numeric/cholesky/laplacian_factor.h"

namespace flipfree::conformal {

class NewtonSystem {
 public:
  NewtonSystem() = default;
  // `pinned`: flags of the unknowns that are fixed, one at least; otherwise the last one is.
  explicit NewtonSystem(const std::vector<char>& pinned);

  // Solves H d = -g; without pins up to a constant, d shifted so that its largest and smallest
  // entries are opposite. The Hessian has the entries -w_ij, w_ij = (cot + cot) / 2 over the edges
  // between unknowns i and j, and zero row sums. The symbolic analysis is kept while the pattern
  // stays, its order while only flips changed it. False, and the direction of no meaning, if a
  // cotangent is not finite, the matrix not positive definite to working precision or the solution
  // not finite. The low parts come from the refinement; they are what counts along heavy couplings.
  // Where couplings are heavier than two doubles can serve - the last place of the direction times
  // the weight is an angle - it has `bits` bits.
  bool solve(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient, int bits,
             FineVector& direction, ExecutionContext& context);

  // Factorizes the Hessian alone, for solutions with many right-hand sides. False as solve().
  bool factorize(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient,
                 ExecutionContext& context);
  // X with H X = B for columns of B that sum to zero (#V x k), X zero at the last unknown; by the
  // last factorize(). Precondition: no solve() since.
  Eigen::MatrixXd solve_columns(const Eigen::Ref<const Eigen::MatrixXd>& columns,
                                ExecutionContext& context) const;

  // X with H X = b, zero at the pinned unknowns, entries of b there not looked at; likewise.
  std::vector<double> solve_pinned(const std::vector<double>& b, ExecutionContext& context) const;

  // Derivative of the energy along the last direction, -d' H d: a sum of squares.
  double slope() const { return slope_; }

 private:
  // Rows of the matrix and one more, which stands for what is fixed.
  Index row_count(std::size_t unknowns) const {
    return row_.empty() ? static_cast<Index>(unknowns) : last_row_ + 1;
  }
  Index row_of(Index unknown) const { return row_.empty() ? unknown : row_[at(unknown)]; }
  // Values of unknowns by rows; what the free ones sum up to is taken from the last one.
  std::vector<double> by_rows(const std::vector<double>& values) const;
  template <typename T>
  void by_unknowns(std::vector<T>& values) const;
  bool factorize(ExecutionContext& context);
  double by_cholesky(const std::vector<double>& g, double goal, FineVector& d,
                     ExecutionContext& context);
  double by_accurate_factor(const std::vector<double>& g, double error, int bits, FineVector& d,
                            ExecutionContext& context);
  // False if a weight is not a finite number.
  bool collect_couplings(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient);
  // From the couplings; `last` is the fixed unknown.
  void build_matrix(Index last);
  // What the low parts of d contribute to H d at most, entry by entry of the couplings.
  double rounding(const FineVector& d) const;
  // r = -g - H d, and its largest entry.
  double residual(const std::vector<double>& g, const FineVector& d, std::vector<double>& r) const;

  std::vector<Index> row_;  // of each unknown, where some are pinned
  Index last_row_ = 0;
  std::vector<numeric::Coupling> couplings_;  // one per pair of different unknowns, weight > = 0
  numeric::SparseMatrix matrix_;
  std::vector<Index> analysed_outer_;
  std::vector<Index> analysed_inner_;
  numeric::SparseCholesky cholesky_;
  numeric::LaplacianFactor accurate_;
  bool use_accurate_ = false;
  double slope_ = 0.0;
};

}  // namespace flipfree::conformal
