// Compiled once for every processor and, with FLIPFREE_AVX2, once more for those that have AVX2 and
// FMA (CMakeLists.txt). Eigen has another name then, as the linker would take one of two functions
// of the same name, which could be the one that a processor cannot run.
#ifdef FLIPFREE_AVX2
#define Eigen EigenAvx2
#endif
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>

#include "flipfree/numeric/dense_kernels.h"

namespace flipfree::numeric::dense {
namespace {

using Block = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstBlock = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using Column = Eigen::Map<Eigen::VectorXd>;
using ConstColumn = Eigen::Map<const Eigen::VectorXd>;

Block block(double* a, int rows, int columns, int ld) {
  return {a, rows, columns, Eigen::OuterStride<>(ld)};
}
ConstBlock block(const double* a, int rows, int columns, int ld) {
  return {a, rows, columns, Eigen::OuterStride<>(ld)};
}

// Products are summed up in blocks that suit the caches: not those of the machine, on which last
// bits would depend.
const bool has_fixed_blocks = [] {
  Eigen::setCpuCacheSizes(32 << 10, 512 << 10, 4 << 20);
  return true;
}();

bool cholesky(int n, double* a, int lda) {
  Eigen::Ref<Eigen::MatrixXd> in_place = block(a, n, n, lda);
  if (Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(in_place).info() != Eigen::Success) return false;
  for (int i = 0; i < n; ++i) {
    if (!(in_place(i, i) > 0) || !std::isfinite(in_place(i, i))) return false;
  }
  return true;
}

void solve_right_transposed(int m, int n, const double* l, int ldl, double* b, int ldb) {
  block(l, n, n, ldl)
      .transpose()
      .triangularView<Eigen::Upper>()
      .solveInPlace<Eigen::OnTheRight>(block(b, m, n, ldb));
}

void subtract_square(int n, int k, const double* a, int lda, double* c, int ldc) {
  block(c, n, n, ldc).selfadjointView<Eigen::Lower>().rankUpdate(block(a, n, k, lda), -1.0);
}

void subtract_product(int m, int n, int k, const double* a, int lda, const double* b, int ldb,
                      double* c, int ldc) {
  block(c, m, n, ldc).noalias() -= block(a, m, k, lda) * block(b, n, k, ldb).transpose();
}

void solve_left(int n, int k, const double* l, int ldl, double* b, int ldb) {
  const ConstBlock factor = block(l, n, n, ldl);
  if (k == 1) {
    factor.triangularView<Eigen::Lower>().solveInPlace(Column(b, n));
  } else {
    factor.triangularView<Eigen::Lower>().solveInPlace(block(b, n, k, ldb));
  }
}

void solve_left_transposed(int n, int k, const double* l, int ldl, double* b, int ldb) {
  const ConstBlock factor = block(l, n, n, ldl);
  if (k == 1) {
    factor.transpose().triangularView<Eigen::Upper>().solveInPlace(Column(b, n));
  } else {
    factor.transpose().triangularView<Eigen::Upper>().solveInPlace(block(b, n, k, ldb));
  }
}

void product(int m, int n, int k, const double* a, int lda, const double* b, int ldb, double* c,
             int ldc) {
  if (k == 1) {
    Column(c, m).noalias() = block(a, m, n, lda) * ConstColumn(b, n);
  } else {
    block(c, m, k, ldc).noalias() = block(a, m, n, lda) * block(b, n, k, ldb);
  }
}

void subtract_transposed_product(int m, int n, int k, const double* a, int lda, const double* b,
                                 int ldb, double* c, int ldc) {
  if (k == 1) {
    Column(c, n).noalias() -= block(a, m, n, lda).transpose() * ConstColumn(b, m);
  } else {
    block(c, n, k, ldc).noalias() -= block(a, m, n, lda).transpose() * block(b, m, k, ldb);
  }
}

constexpr Kernels kOurs = {
    cholesky,   solve_right_transposed, subtract_square, subtract_product,
    solve_left, solve_left_transposed,  product,         subtract_transposed_product};

}  // namespace

#ifdef FLIPFREE_AVX2
const Kernels& avx2_kernels();
const Kernels& avx2_kernels() { return kOurs; }
#else
const Kernels& plain_kernels() { return kOurs; }

#ifdef FLIPFREE_HAS_AVX2
const Kernels& avx2_kernels();  // this file, compiled a second time

const Kernels& kernels() {
  static const bool can = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return can ? avx2_kernels() : plain_kernels();
}
#else
const Kernels& kernels() { return plain_kernels(); }
#endif
#endif

}  // namespace flipfree::numeric::dense
