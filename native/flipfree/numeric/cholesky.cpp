#include "flipfree/numeric/cholesky.h"

#include <cholmod.h>

#include <cstring>

#include "flipfree/base/error.h"

namespace flipfree {

struct SparseCholesky::State {
  cholmod_common common;
  cholmod_factor* factor = nullptr;
  bool factorized = false;

  State() {
    cholmod_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.nmethods = 2;
    common.method[0].ordering = CHOLMOD_METIS;
    common.method[1].ordering = CHOLMOD_AMD;
    common.postorder = 1;
    common.final_ll = 1;
  }
  ~State() {
    if (factor != nullptr) cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

namespace {

// A view of the lower triangle; nothing is copied.
cholmod_sparse view(const SparseMatrix& matrix) {
  cholmod_sparse view;
  std::memset(&view, 0, sizeof(view));
  view.nrow = static_cast<std::size_t>(matrix.rows());
  view.ncol = static_cast<std::size_t>(matrix.cols());
  view.nzmax = static_cast<std::size_t>(matrix.nonZeros());
  view.p = const_cast<Index*>(matrix.outerIndexPtr());
  view.i = const_cast<Index*>(matrix.innerIndexPtr());
  view.x = const_cast<double*>(matrix.valuePtr());
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

}  // namespace

SparseCholesky::SparseCholesky() : state_(std::make_unique<State>()) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

bool SparseCholesky::analyzed() const { return state_->factor != nullptr; }

void SparseCholesky::analyze(const SparseMatrix& matrix, ExecutionContext& context) {
  context.check();
  if (state_->factor != nullptr) cholmod_free_factor(&state_->factor, &state_->common);
  cholmod_sparse lower = view(matrix);
  state_->factor = cholmod_analyze(&lower, &state_->common);
  state_->factorized = false;
  if (state_->factor == nullptr) {
    throw_not_converged(ErrorCode::kFactorizationFailed,
                        "The symbolic analysis of a sparse matrix failed: not enough memory, or "
                        "too large for 32-bit "
                        "indices. Split the mesh into smaller charts.");
  }
  context.check();
}

bool SparseCholesky::factorize(const SparseMatrix& matrix, ExecutionContext& context) {
  context.check();
  cholmod_sparse lower = view(matrix);
  const bool ran = cholmod_factorize(&lower, state_->factor, &state_->common) != 0;
  state_->factorized =
      ran && state_->common.status == CHOLMOD_OK && state_->factor->minor == state_->factor->n;
  context.check();
  return state_->factorized;
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs,
                                      ExecutionContext& context) const {
  context.check();
  if (!state_->factorized) throw InternalError("solve() without a successful factorize()");
  cholmod_dense b;
  std::memset(&b, 0, sizeof(b));
  b.nrow = static_cast<std::size_t>(rhs.rows());
  b.ncol = static_cast<std::size_t>(rhs.cols());
  b.d = static_cast<std::size_t>(rhs.outerStride());
  b.nzmax = b.d * b.ncol;
  b.x = const_cast<double*>(rhs.data());
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  cholmod_dense* x = cholmod_solve(CHOLMOD_A, state_->factor, &b, &state_->common);
  if (x == nullptr) throw InternalError("cholmod_solve failed");
  Eigen::MatrixXd result =
      Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(x->x), rhs.rows(), rhs.cols());
  cholmod_free_dense(&x, &state_->common);
  return result;
}

std::int64_t SparseCholesky::factor_nonzeros() const {
  return static_cast<std::int64_t>(state_->common.lnz);
}

}  // namespace flipfree
