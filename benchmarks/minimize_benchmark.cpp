// Distortion minimisation of a bumpy sheet from a poor start, and rounding of the result.
//
//   build/benchmarks/minimize_benchmark
//
// Arguments: cells per side (2 side^2 triangles), threads. Counters: iterations, energy reached.
#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <variant>

#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/rounding.h"

namespace {

using namespace flipfree;

mesh::Surface sheet(Index side) {
  mesh::Surface surface;
  const Index line = side + 1;
  surface.vertices.resize(line * line, 3);
  for (Index v = 0; v < line * line; ++v) {
    const double x = static_cast<double>(v % line) / side;
    const double y = static_cast<double>(v / line) / side;
    surface.vertices.row(v) << x, y, 0.1 * std::sin(15.7 * x) * std::sin(15.7 * y);
  }
  surface.faces.resize(2 * side * side, 3);
  for (Index c = 0; c < side * side; ++c) {
    const Index a = c / side * line + c % side;
    surface.faces.row(2 * c) << a, a + 1, a + line + 1;
    surface.faces.row(2 * c + 1) << a, a + line + 1, a + line;
  }
  return surface;
}

// The plan squeezed towards one side by a factor of 1000: far from isometric, flip-free.
Points2 poor_start(const mesh::Surface& surface) {
  Points2 uv = surface.vertices.leftCols<2>();
  for (Eigen::Index v = 0; v < uv.rows(); ++v) {
    const double scale = std::pow(1000.0, uv(v, 0));
    uv.row(v) << scale, uv(v, 1) * scale;
  }
  return uv;
}

void minimize(benchmark::State& state) {
  const mesh::Surface surface = sheet(static_cast<Index>(state.range(0)));
  const Points2 start = poor_start(surface);
  Stats stats;
  for (auto _ : state) {
    ExecutionContext context;
    context.threads = static_cast<int>(state.range(1));
    benchmark::DoNotOptimize(distortion::minimize_distortion(surface, start, {}, context, stats));
  }
  state.counters["iterations"] =
      static_cast<double>(std::get<std::int64_t>(stats.at("distortion.iterations")));
  state.counters["energy"] = std::get<double>(stats.at("distortion.energy"));
}

void round_down(benchmark::State& state) {
  const mesh::Surface surface = sheet(static_cast<Index>(state.range(0)));
  const Points2 uv = surface.vertices.leftCols<2>() / 3.0;
  Stats stats;
  for (auto _ : state) {
    ExecutionContext context;
    context.threads = static_cast<int>(state.range(1));
    benchmark::DoNotOptimize(distortion::round_to_storage(surface.faces, uv, {}, context, stats));
  }
}

BENCHMARK(minimize)
    ->ArgsProduct({{71, 224, 708}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(round_down)
    ->ArgsProduct({{224, 708}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
