#include "flipfree/numeric/dense_kernels.h"

#include <cblas.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <new>
#include <vector>

#include "flipfree/base/helpers.h"

// LAPACK, part of the same library; it has no C header of its own everywhere.
extern "C" void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info,
                        std::size_t);
// OpenBLAS's own, where the library shows them (cmake/dependencies.cmake).
#ifdef FLIPFREE_BLAS_MEMORY
extern "C" void* blas_memory_alloc(int position);
extern "C" void blas_memory_free(void* buffer);
#endif

namespace flipfree::numeric::dense {

namespace {

#ifndef FLIPFREE_BLAS_MEMORY
void* blas_memory_alloc(int) { return nullptr; }
void blas_memory_free(void*) {}
#endif

constexpr int kMost = static_cast<int>(kMostThreads);

// What the process has asked of the BLAS, whose buffers are the process's as well.
struct Buffers {
  std::mutex mutex;
  int calls = 0;
  int wanted = 0;
  int taken = 0;
};
Buffers& buffers() {
  static Buffers all;
  return all;
}

// Held all at once, so that there are as many. Those that others hold are more than enough.
void take(int count) {
  constexpr std::size_t kBytes = std::size_t{132} << 20;
  std::vector<void*> held;
  held.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    try {
      ::operator delete(::operator new(kBytes));
    } catch (const std::bad_alloc&) {
      for (void* buffer : held) blas_memory_free(buffer);
      throw;
    }
    held.push_back(blas_memory_alloc(0));
  }
  for (void* buffer : held) blas_memory_free(buffer);
}

}  // namespace

Calls::Calls(int threads)
    : threads_(threads > 0 ? std::min(threads, kMost) : static_cast<int>(core_count())) {
  openblas_set_num_threads(1);
  Buffers& all = buffers();
  const std::scoped_lock lock(all.mutex);
  // Beside its own thread every call has the same helpers.
  const int needed = std::min(all.wanted + threads_, all.calls + kMost);
  if (needed > all.taken) {
    take(needed);
    all.taken = needed;
  }
  ++all.calls;
  all.wanted += threads_;
}

Calls::~Calls() {
  Buffers& all = buffers();
  const std::scoped_lock lock(all.mutex);
  --all.calls;
  all.wanted -= threads_;
}

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

namespace {

// y = y + A x over four columns of A, or what is left of four.
template <int kColumns>
void add_columns(int rows, const double* a, std::ptrdiff_t lda, const double* x,
                 double* __restrict y) {
  for (int i = 0; i < rows; ++i) {
    double sum = a[i] * x[0];
    for (int k = 1; k < kColumns; ++k) sum += a[k * lda + i] * x[k];
    y[i] += sum;
  }
}

// x = x - A' y for four columns of A; two partial sums each, so that additions need not wait.
template <int kColumns>
void subtract_dots(int rows, const double* a, std::ptrdiff_t lda, const double* y, double* x) {
  double even[kColumns] = {};
  double odd[kColumns] = {};
  int i = 0;
  for (; i + 1 < rows; i += 2) {
    for (int k = 0; k < kColumns; ++k) {
      even[k] += a[k * lda + i] * y[i];
      odd[k] += a[k * lda + i + 1] * y[i + 1];
    }
  }
  for (int k = 0; k < kColumns; ++k) {
    if (i < rows) even[k] += a[k * lda + i] * y[i];
    x[k] -= even[k] + odd[k];
  }
}

}  // namespace

void solve_trapezoid(int c, int r, const double* panel, double* x, double* y) {
  const std::ptrdiff_t ld = c + r;
  for (int j = 0; j < c; ++j) {
    const double* column = panel + j * ld;
    x[j] /= column[j];
    for (int i = j + 1; i < c; ++i) x[i] -= column[i] * x[j];
  }
  for (int i = 0; i < r; ++i) y[i] = 0.0;
  const double* below = panel + c;
  int j = 0;
  for (; j + 4 <= c; j += 4) add_columns<4>(r, below + j * ld, ld, x + j, y);
  for (; j < c; ++j) add_columns<1>(r, below + j * ld, ld, x + j, y);
}

void solve_trapezoid_transposed(int c, int r, const double* panel, double* x, const double* y) {
  const std::ptrdiff_t ld = c + r;
  const double* below = panel + c;
  int k = 0;
  for (; k + 4 <= c; k += 4) subtract_dots<4>(r, below + k * ld, ld, y, x + k);
  for (; k < c; ++k) subtract_dots<1>(r, below + k * ld, ld, y, x + k);
  for (int j = c; j-- > 0;) {
    const double* column = panel + j * ld;
    double sum = x[j];
    for (int i = j + 1; i < c; ++i) sum -= column[i] * x[i];
    x[j] = sum / column[j];
  }
}

}  // namespace flipfree::numeric::dense
