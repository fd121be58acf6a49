// What more cores would do: work, serial share and span of whole calls, and the speedup that the
// parallel loops' chunks allow (base/threads/work_meter.h).
//
//   build/benchmarks/work_and_span [unwrap|conformal|seamless] [TRIANGLES]
//
// unwrap: a bumpy sheet with irregular vertices; the others: a bumpy sphere, four cones of half a
// turn (conformal), eight of a quarter turn (seamless). Everything
// runs on one thread, and CPU seconds are counted, so that a busy machine disturbs little.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/threads/work_meter.h"
#include "flipfree/conformal/map/map.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "flipfree/unwrap/unwrap.h"

namespace {

using namespace flipfree;

mesh::Surface sheet(Index triangles) {
  const auto side = static_cast<Index>(std::lround(std::sqrt(triangles / 2.0)));
  mesh::Surface surface;
  const Index line = side + 1;
  surface.vertices.resize(line * line, 3);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(-0.3, 0.3);
  for (Index v = 0; v < line * line; ++v) {
    const Index i = v % line, j = v / line;
    const double dx = jitter(random), dy = jitter(random);
    const bool rim = i == 0 || j == 0 || i == side || j == side;
    const double x = (static_cast<double>(i) + (rim ? 0.0 : dx)) / side;
    const double y = (static_cast<double>(j) + (rim ? 0.0 : dy)) / side;
    surface.vertices.row(v) << x, y,
        0.1 * std::sin(5.0 * std::numbers::pi * x) * std::cos(5.0 * std::numbers::pi * y);
  }
  surface.faces.resize(2 * side * side, 3);
  for (Index c = 0; c < side * side; ++c) {
    const Index a = c / side * line + c % side;
    surface.faces.row(2 * c) << a, a + 1, a + line + 1;
    surface.faces.row(2 * c + 1) << a, a + line + 1, a + line;
  }
  return surface;
}

// A globe with two poles, its radius a wave.
mesh::Surface ball(Index triangles) {
  const auto rings = static_cast<Index>(std::lround(std::sqrt(triangles / 4.0)));
  const Index sectors = 2 * rings;
  mesh::Surface surface;
  surface.vertices.resize(2 + (rings - 1) * sectors, 3);
  surface.faces.resize(2 * sectors * (rings - 1), 3);
  const auto place = [](double polar, double turn) -> Eigen::Vector3d {
    const double x = std::sin(polar) * std::cos(turn), y = std::sin(polar) * std::sin(turn);
    const double z = std::cos(polar);
    return (1.0 + 0.15 * std::sin(4.0 * x) * std::cos(3.0 * y + z)) * Eigen::Vector3d(x, y, z);
  };
  surface.vertices.row(0) = place(0.0, 0.0).transpose();
  surface.vertices.row(1) = place(std::numbers::pi, 0.0).transpose();
  const auto at = [&](Index ring, Index sector) {
    return 2 + (ring - 1) * sectors + sector % sectors;
  };
  Index f = 0;
  for (Index r = 1; r < rings; ++r) {
    for (Index s = 0; s < sectors; ++s) {
      surface.vertices.row(at(r, s)) =
          place(std::numbers::pi * r / rings, 2.0 * std::numbers::pi * s / sectors).transpose();
      if (r == 1) surface.faces.row(f++) << 0, at(1, s), at(1, s + 1);
      if (r == rings - 1) surface.faces.row(f++) << 1, at(r, s + 1), at(r, s);
      if (r + 1 == rings) continue;
      surface.faces.row(f++) << at(r, s), at(r + 1, s), at(r + 1, s + 1);
      surface.faces.row(f++) << at(r, s), at(r + 1, s + 1), at(r, s + 1);
    }
  }
  return surface;
}

// Of `count` vertices well apart: every one that has this rank.
std::vector<std::size_t> apart(const mesh::Surface& surface, std::size_t count) {
  const auto vertices = static_cast<std::size_t>(surface.vertices.rows());
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < count; ++i) found.push_back((2 * i + 1) * vertices / (2 * count) + i);
  return found;
}

bool run(const std::string& call, const mesh::Surface& surface, ExecutionContext& context) {
  const auto vertices = static_cast<std::size_t>(surface.vertices.rows());
  if (call == "unwrap") return unwrap::unwrap(surface, {}, context).certificate.ok;
  if (call == "conformal") {
    std::vector<double> angles(vertices, 2.0 * std::numbers::pi);
    for (const std::size_t v : apart(surface, 4)) angles[v] = std::numbers::pi;
    return !conformal::conformal_map(surface, nullptr, angles, {}, context).failure;
  }
  if (call == "seamless") {
    std::vector<Index> quarters(vertices, 4);
    for (const std::size_t v : apart(surface, 8)) quarters[v] = 3;
    return seamless::compute_seamless_map(surface, quarters, {}, context).certificate.ok;
  }
  return false;
}

void print(const WorkMeter::Stage& stage) {
  const auto& s = stage.seconds;
  std::printf("| %s | %.2f | %.2f | %.0f %% | %.2f |", stage.name, s[0], stage.serial,
              100.0 * stage.serial / s[0], s[5]);
  for (std::size_t kind = 1; kind < 5; ++kind) std::printf(" %.2f |", s[0] / s[kind]);
  std::printf(" %zu |\n", stage.loops);
}

}  // namespace

int main(int count, char** arguments) {
  const std::string call = count > 1 ? arguments[1] : "unwrap";
  const Index triangles = count > 2 ? std::atoi(arguments[2]) : 1'000'000;
  const mesh::Surface surface = call == "unwrap" ? sheet(triangles) : ball(triangles);
  WorkMeter meter;
  ExecutionContext context;
  context.meter = &meter;
  context.threads = 16;
  if (!run(call, surface, context)) {
    std::printf("%s: no map\n", call.c_str());
    return 1;
  }
  std::printf("%s, %d triangles\n\n", call.c_str(), static_cast<int>(surface.faces.rows()));
  std::printf("| stage | work s | serial s | serial | span s | 2 cores | 4 | 8 | 16 | loops |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|\n");
  WorkMeter::Stage all{.name = "all"};
  for (const WorkMeter::Stage& stage : meter.stages()) {
    for (std::size_t kind = 0; kind < stage.seconds.size(); ++kind)
      all.seconds[kind] += stage.seconds[kind];
    all.serial += stage.serial;
    all.loops += stage.loops;
    if (stage.seconds[0] > 0.005) print(stage);
  }
  print(all);
}
