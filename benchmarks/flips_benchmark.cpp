// What the work on intrinsic triangulations costs per step: Delaunay tests, flips, angles,
// logarithms, in double and with MPFR numbers; a flip replayed by an overlay. The distances between
// checks for cancel (ChecksPer) and the flips that are worth a search for a direct way (kLongWay)
// follow from these figures.
//
//   build/benchmarks/flips_benchmark
//
// Argument: mantissa bits. `items_per_second` counts edges, flips or faces.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "flipfree/intrinsic/delaunay_metric.h"
#include "flipfree/intrinsic/overlay/overlay_coordinates.h"

namespace {

using flipfree::EdgeId;
using flipfree::ExecutionContext;
using flipfree::Index;
using flipfree::Triangles;
using flipfree::intrinsic::DelaunayMetric;
using flipfree::intrinsic::FlipRule;
using flipfree::intrinsic::IntrinsicMesh;
using flipfree::numeric::BigFloat;
using flipfree::numeric::ScalarTraits;

constexpr Index kSide = 60;

// A torus of kSide x kSide quadrilaterals.
IntrinsicMesh torus() {
  Triangles faces(2 * kSide * kSide, 3);
  const auto id = [](Index i, Index j) { return (i % kSide) * kSide + j % kSide; };
  for (Index i = 0; i < kSide; ++i) {
    for (Index j = 0; j < kSide; ++j) {
      const Index f = 2 * (i * kSide + j);
      faces.row(f) << id(i, j), id(i + 1, j), id(i + 1, j + 1);
      faces.row(f + 1) << id(i, j), id(i + 1, j + 1), id(i, j + 1);
    }
  }
  return flipfree::intrinsic::build_intrinsic_mesh(kSide * kSide, faces).mesh;
}

template <typename T>
DelaunayMetric<T> metric_of(int bits) {
  IntrinsicMesh mesh = torus();
  std::vector<T> length;
  for (std::size_t e = 0; e < mesh.edge_count(); ++e)
    length.push_back(
        ScalarTraits<T>::make(1.0 + 0.3 * std::sin(0.7 * static_cast<double>(e)), bits));
  return {std::move(mesh), std::move(length), bits};
}

template <typename T>
void make_delaunay(benchmark::State& state) {
  const ExecutionContext context;
  std::size_t flips = 0;
  for (auto _ : state) {
    state.PauseTiming();
    DelaunayMetric<T> metric = metric_of<T>(static_cast<int>(state.range(0)));
    state.ResumeTiming();
    metric.template make_delaunay<FlipRule::kPtolemy>(context);
    flips += metric.flips().size();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(flips));
}

template <typename T>
void test_delaunay(benchmark::State& state) {
  const ExecutionContext context;
  DelaunayMetric<T> metric = metric_of<T>(static_cast<int>(state.range(0)));
  metric.template make_delaunay<FlipRule::kPtolemy>(context);
  for (auto _ : state) metric.template make_delaunay<FlipRule::kPtolemy>(context);
  state.SetItemsProcessed(state.iterations() *
                          static_cast<std::int64_t>(metric.mesh().edge_count()));
}

template <typename T>
void angles(benchmark::State& state) {
  using std::atan2;
  const DelaunayMetric<T> metric = metric_of<T>(static_cast<int>(state.range(0)));
  std::size_t f = 0;
  for (auto _ : state) {
    flipfree::HalfedgeId h[3];
    benchmark::DoNotOptimize(metric.shape(f, 0.0, h));
    const T angle = atan2(metric.length(h[0]), metric.length(h[1]));
    benchmark::DoNotOptimize(&angle);
    f = (f + 1) % metric.mesh().face_count();
  }
  state.SetItemsProcessed(state.iterations());
}

template <typename T>
void logarithm(benchmark::State& state) {
  using std::log;
  const T x = ScalarTraits<T>::make(1.7, static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const T y = log(x);
    benchmark::DoNotOptimize(&y);
  }
  state.SetItemsProcessed(state.iterations());
}

void replay(benchmark::State& state) {
  const ExecutionContext context;
  DelaunayMetric<double> metric = metric_of<double>(53);
  const IntrinsicMesh start = metric.mesh();
  metric.make_delaunay<FlipRule::kPtolemy>(context);
  for (auto _ : state) {
    state.PauseTiming();
    flipfree::intrinsic::OverlayCoordinates coordinates(start);
    state.ResumeTiming();
    flipfree::intrinsic::replay_flips(metric.flips(), 0, metric.flips().size(), context,
                                      [&](EdgeId e) { coordinates.flip(2 * e); });
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(metric.flips().size()));
}

BENCHMARK(make_delaunay<double>)->Arg(53);
BENCHMARK(make_delaunay<BigFloat<4>>)->Arg(128);
BENCHMARK(make_delaunay<BigFloat<64>>)->Arg(4096);
BENCHMARK(test_delaunay<double>)->Arg(53);
BENCHMARK(test_delaunay<BigFloat<64>>)->Arg(4096);
BENCHMARK(angles<double>)->Arg(53);
BENCHMARK(angles<BigFloat<64>>)->Arg(4096);
BENCHMARK(logarithm<double>)->Arg(53);
BENCHMARK(logarithm<BigFloat<64>>)->Arg(4096);
BENCHMARK(replay);

}  // namespace

BENCHMARK_MAIN();
