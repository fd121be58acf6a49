#include "flipfree/numeric/dense_kernels.h"

#include <cblas.h>

#include <cmath>
#include <cstddef>

// LAPACK, part of the same library; it has no C header of its own everywhere.
extern "C" void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info,
                        std::size_t);

namespace flipfree::dense {

void use_one_thread() { openblas_set_num_threads(1); }

bool cholesky(int n, double* a, int lda) {
  int info = 0;
  dpotrf_("L", &n, a, &lda, &info, 1);
  if (info != 0) return false;
  for (int i = 0; i < n; ++i) {
    const double pivot = a[static_cast<std::ptrdiff_t>(i) * (lda + 1)];
    if (!(pivot > 0) || !std::isfinite(pivot)) return false;
  }
  return true;
}

void solve_right_transposed(int m, int n, const double* l, int ldl, double* b, int ldb) {
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, m, n, 1.0, l, ldl, b,
              ldb);
}

void subtract_square(int n, int k, const double* a, int lda, double beta, double* c, int ldc) {
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, n, k, -1.0, a, lda, beta, c, ldc);
}

void subtract_product(int m, int n, int k, const double* a, int lda, const double* b, int ldb,
                      double beta, double* c, int ldc) {
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, m, n, k, -1.0, a, lda, b, ldb, beta, c, ldc);
}

void solve_left(int n, int k, const double* l, int ldl, double* b, int ldb) {
  if (k == 1) {
    cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, n, l, ldl, b, 1);
  } else {
    cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, n, k, 1.0, l, ldl,
                b, ldb);
  }
}

void solve_left_transposed(int n, int k, const double* l, int ldl, double* b, int ldb) {
  if (k == 1) {
    cblas_dtrsv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, n, l, ldl, b, 1);
  } else {
    cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasTrans, CblasNonUnit, n, k, 1.0, l, ldl,
                b, ldb);
  }
}

void product(int m, int n, int k, const double* a, int lda, const double* b, int ldb, double* c,
             int ldc) {
  if (k == 1) {
    cblas_dgemv(CblasColMajor, CblasNoTrans, m, n, 1.0, a, lda, b, 1, 0.0, c, 1);
  } else {
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, m, k, n, 1.0, a, lda, b, ldb, 0.0, c,
                ldc);
  }
}

void subtract_transposed_product(int m, int n, int k, const double* a, int lda, const double* b,
                                 int ldb, double* c, int ldc) {
  if (k == 1) {
    cblas_dgemv(CblasColMajor, CblasTrans, m, n, -1.0, a, lda, b, 1, 1.0, c, 1);
  } else {
    cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, n, k, m, -1.0, a, lda, b, ldb, 1.0, c,
                ldc);
  }
}

}  // namespace flipfree::dense
