// Sparse Cholesky on Newton-like systems of triangulated grids: analysis, factorization, solve; and
// CHOLMOD with METIS ordering on the same systems, where it is installed.
//
//   build/benchmarks/cholesky_benchmark
//
// Arguments: vertices per side, threads. `flops` is what the analysis predicts for one
// factorization; with `iterations` and the time it gives the rate.
#include <benchmark/benchmark.h>
#if FLIPFREE_HAVE_CHOLMOD
#include <cholmod.h>
#endif

#include <algorithm>
#include <vector>

#include "flipfree/numeric/cholesky/cholesky.h"

namespace {

using flipfree::ExecutionContext;
using flipfree::Index;
using flipfree::numeric::SparseCholesky;
using flipfree::numeric::SparseMatrix;

// Two unknowns per vertex of a triangulated grid, diagonally dominant; lower triangle.
SparseMatrix system_of_grid(Index side) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  const auto couple = [&](Index a, Index b) {
    for (Index k = 0; k < 2; ++k) {
      entries.emplace_back(2 * a + k, 2 * a + k, 1.1);
      entries.emplace_back(2 * b + k, 2 * b + k, 1.1);
      for (Index l = 0; l < 2; ++l)
        entries.emplace_back(2 * b + k, 2 * a + l, k == l ? -1.0 : 0.01);
    }
  };
  for (Index v = 0; v < side * side; ++v) {
    entries.emplace_back(2 * v + 1, 2 * v, 0.0);
    if (v % side + 1 < side) couple(v, v + 1);
    if (v / side + 1 < side) couple(v, v + side);
    if (v % side + 1 < side && v / side + 1 < side) couple(v, v + side + 1);
  }
  SparseMatrix matrix(2 * side * side, 2 * side * side);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// The system and the threads that a benchmark's arguments name.
struct Case {
  SparseMatrix matrix;
  ExecutionContext context;
  SparseCholesky solver;

  explicit Case(const benchmark::State& state)
      : matrix(system_of_grid(static_cast<Index>(state.range(0)))) {
    context.threads = static_cast<int>(state.range(1));
  }
  void factorize(benchmark::State& state) {
    solver.analyze(matrix, context);
    if (!solver.factorize(matrix, context)) state.SkipWithError("not positive definite");
  }
};

void analyze(benchmark::State& state) {
  Case given(state);
  for (auto _ : state) {
    SparseCholesky solver;
    solver.analyze(given.matrix, given.context);
    benchmark::DoNotOptimize(solver);
  }
}

void factorize(benchmark::State& state) {
  Case given(state);
  given.factorize(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(given.solver.factorize(given.matrix, given.context));
}

void solve(benchmark::State& state) {
  Case given(state);
  given.factorize(state);
  const Eigen::VectorXd rhs = Eigen::VectorXd::Ones(given.matrix.rows());
  for (auto _ : state) benchmark::DoNotOptimize(given.solver.solve(rhs, given.context));
}

const std::vector<std::int64_t> kSides{71, 224, 708};

void timed(benchmark::internal::Benchmark* benchmark) {
  benchmark->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
}

void on_threads(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgsProduct({kSides, {1, 2}});
}

BENCHMARK(analyze)->Apply(on_threads)->Apply(timed);
BENCHMARK(factorize)->Apply(on_threads)->Apply(timed);
BENCHMARK(solve)->Apply(on_threads)->Apply(timed);

#if FLIPFREE_HAVE_CHOLMOD

struct Cholmod {
  cholmod_common common;
  cholmod_sparse matrix{};
  cholmod_factor* factor = nullptr;

  explicit Cholmod(const SparseMatrix& lower) {
    cholmod_start(&common);
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_METIS;
    matrix.nrow = matrix.ncol = static_cast<std::size_t>(lower.rows());
    matrix.nzmax = static_cast<std::size_t>(lower.nonZeros());
    matrix.p = const_cast<Index*>(lower.outerIndexPtr());
    matrix.i = const_cast<Index*>(lower.innerIndexPtr());
    matrix.x = const_cast<double*>(lower.valuePtr());
    matrix.stype = -1;
    matrix.itype = CHOLMOD_INT;
    matrix.xtype = CHOLMOD_REAL;
    matrix.dtype = CHOLMOD_DOUBLE;
    matrix.sorted = matrix.packed = 1;
  }
  ~Cholmod() {
    release();
    cholmod_finish(&common);
  }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;
  void release() {
    if (factor != nullptr) cholmod_free_factor(&factor, &common);
  }
};

void cholmod_metis_analyze(benchmark::State& state) {
  const SparseMatrix matrix = system_of_grid(static_cast<Index>(state.range(0)));
  Cholmod solver(matrix);
  for (auto _ : state) {
    solver.release();
    solver.factor = cholmod_analyze(&solver.matrix, &solver.common);
  }
  state.counters["nonzeros"] = solver.common.lnz;
}

void cholmod_metis_factorize(benchmark::State& state) {
  const SparseMatrix matrix = system_of_grid(static_cast<Index>(state.range(0)));
  Cholmod solver(matrix);
  solver.factor = cholmod_analyze(&solver.matrix, &solver.common);
  for (auto _ : state) {
    if (cholmod_factorize(&solver.matrix, solver.factor, &solver.common) == 0) {
      state.SkipWithError("not positive definite");
    }
  }
  state.counters["flops"] = solver.common.fl;
  state.counters["nonzeros"] = solver.common.lnz;
}

BENCHMARK(cholmod_metis_analyze)->ArgsProduct({kSides})->Apply(timed);
BENCHMARK(cholmod_metis_factorize)->ArgsProduct({kSides})->Apply(timed);

#endif

}  // namespace

BENCHMARK_MAIN();
