#include "flipfree/numeric/dense_kernels.h"

#include <cstddef>

namespace flipfree::numeric::dense {

#ifdef FLIPFREE_HAS_AVX2
const Kernels& avx2_kernels();  // dense_blocks.cpp, compiled a second time

const Kernels& kernels() {
  static const bool can = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return can ? avx2_kernels() : plain_kernels();
}
#else
const Kernels& kernels() { return plain_kernels(); }
#endif

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
