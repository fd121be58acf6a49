// Outlines that wind and overlap themselves: pins and lines lie on the sheet that there is, or to
// which a path leads.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/match.h"
#include "matchmaker/requests.h"

namespace flipfree::matchmaker::outline_test {
namespace {

using test::expect_met;

// The whole boundary of `surface` on a band wound `turns` times, samples spread evenly, starting in
// a corner of the band.
MatchRequest wound(const mesh::Surface& surface, double turns, double width, double drift) {
  MatchRequest request;
  request.boundary_loop = test::boundary_of(surface);
  const auto half = static_cast<Index>(request.boundary_loop.size()) / 2;
  const auto at = [&](double s, double r) {
    const double angle = 2 * std::numbers::pi * turns * s;
    const double radius = r + drift * turns * s;
    return Vector2(radius * std::cos(angle), radius * std::sin(angle));
  };
  for (Index i = 0; i < half; ++i)
    request.boundary_uv.push_back(at(static_cast<double>(i) / (half - 1), 1 + width));
  const auto rest = static_cast<Index>(request.boundary_loop.size()) - half;
  for (Index i = 0; i < rest; ++i)
    request.boundary_uv.push_back(at(1 - static_cast<double>(i) / (rest - 1), 1.0));
  return request;
}

// A band wound 1.4 times that drifts by less than its width: its ends lie over each other.
MatchRequest overlapping_band(const mesh::Surface& surface) {
  return wound(surface, 1.4, 1.0, 0.3);
}

TEST(Outline, ANarrowSpiralIsMetWithUsefulEnergyAndTheSameBitsForAnyThreads) {
  const mesh::Surface surface = test::grid(16, 16);
  const MatchRequest request = wound(surface, 1.75, 0.3, 0.6);
  MatchOptions options;
  options.engine = MatchEngine::kOutline;
  ExecutionContext one;
  one.threads = 1;
  const certify::Parametrization map = match(surface, request, options, one);
  expect_met(map, request);
  EXPECT_EQ(map.certificate.overlaps, 0);
  EXPECT_LT(map.certificate.energy, 500);
  EXPECT_LE(map.surface.faces.rows(), 2 * surface.faces.rows());
  ExecutionContext two;
  two.threads = 2;
  EXPECT_EQ(map.uv, match(surface, request, options, two).uv);
  one.cancel();
  EXPECT_THROW(match(surface, request, options, one), Cancelled);
}

TEST(Outline, ABandThatOverlapsItselfIsMetByEitherEngine) {
  const mesh::Surface surface = test::grid(12, 12);
  const MatchRequest request = overlapping_band(surface);
  for (const MatchEngine engine : {MatchEngine::kAuto, MatchEngine::kMatchmaker}) {
    MatchOptions options;
    options.engine = engine;
    ExecutionContext context;
    const certify::Parametrization map = match(surface, request, options, context);
    expect_met(map, request);
    EXPECT_GT(map.certificate.overlaps, 0);
  }
}

TEST(Outline, ALineIsLaidExactly) {
  const mesh::Surface surface = test::grid(12, 12);
  MatchRequest request = overlapping_band(surface);
  PinnedLine line;
  for (VertexId i = 4; i <= 8; ++i) {
    line.vertices.push_back(6 * 13 + i);
    line.polyline.emplace_back(-1.7, -0.2 + 0.1 * (i - 4));
  }
  request.lines = {line};
  ExecutionContext context;
  const certify::Parametrization map = match(surface, request, {}, context);
  for (std::size_t i = 0; i < line.vertices.size(); ++i)
    request.points.push_back({line.vertices[i], line.polyline[i]});
  expect_met(map, request);
}

}  // namespace
}  // namespace flipfree::matchmaker::outline_test
