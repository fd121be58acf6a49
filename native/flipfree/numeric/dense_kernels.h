// The few dense kernels that the sparse factorization is made of, on column-major blocks, lower
// triangles. They run on the calling thread only: parallelism belongs to the caller, who keeps it
// deterministic.
#pragma once

namespace flipfree::numeric::dense {

// Eigen's, compiled for a set of instructions (dense_blocks.cpp). All may throw std::bad_alloc.
struct Kernels {
  // A = L L' in place, n x n. False if a pivot is not positive and finite.
  bool (*cholesky)(int n, double* a, int lda);
  // B = B L^-T: B is m x n, L is n x n.
  void (*solve_right_transposed)(int m, int n, const double* l, int ldl, double* b, int ldb);
  // C = C - A A': C is n x n (lower triangle), A is n x k.
  void (*subtract_square)(int n, int k, const double* a, int lda, double* c, int ldc);
  // C = C - A B': C is m x n, A is m x k, B is n x k.
  void (*subtract_product)(int m, int n, int k, const double* a, int lda, const double* b, int ldb,
                           double* c, int ldc);
  // B = L^-1 B and B = L^-T B: L is n x n, B is n x k.
  void (*solve_left)(int n, int k, const double* l, int ldl, double* b, int ldb);
  void (*solve_left_transposed)(int n, int k, const double* l, int ldl, double* b, int ldb);
  // C = A B: A is m x n, B is n x k, C is m x k.
  void (*product)(int m, int n, int k, const double* a, int lda, const double* b, int ldb,
                  double* c, int ldc);
  // C = C - A' B: A is m x n, B is m x k, C is n x k.
  void (*subtract_transposed_product)(int m, int n, int k, const double* a, int lda,
                                      const double* b, int ldb, double* c, int ldc);
};
// With AVX2 and FMA where this processor has them, else those that every processor can run: last
// bits differ between the two, and between nothing else.
const Kernels& kernels();
const Kernels& plain_kernels();

}  // namespace flipfree::numeric::dense
