#include "flipfree/matchmaker/homotopy/move_outline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/match.h"
#include "flipfree/mesh/topology.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::move_outline_test {
namespace {

std::vector<VertexId> boundary_of(const mesh::Surface& surface) {
  return mesh::boundary_loops(
             surface.faces,
             mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces))
      .front();
}

// The whole boundary of `surface` on a band wound `turns` times, samples spread evenly, starting in
// a corner of the band.
MatchRequest wound(const mesh::Surface& surface, double turns, double width, double drift) {
  MatchRequest request;
  request.boundary_loop = boundary_of(surface);
  const auto half = static_cast<Index>(request.boundary_loop.size()) / 2;
  const auto at = [&](double s, double r) {
    const double angle = 2 * std::numbers::pi * turns * s;
    const double radius = r + drift * turns * s;
    return Vector2(radius * std::cos(angle), radius * std::sin(angle));
  };
  for (Index i = 0; i < half; ++i) {
    request.boundary_uv.push_back(at(static_cast<double>(i) / (half - 1), 1 + width));
  }
  const auto rest = static_cast<Index>(request.boundary_loop.size()) - half;
  for (Index i = 0; i < rest; ++i) {
    request.boundary_uv.push_back(at(1 - static_cast<double>(i) / (rest - 1), 1.0));
  }
  return request;
}

void expect_met(const certify::Parametrization& map, const MatchRequest& request) {
  EXPECT_TRUE(map.certificate.ok);
  for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
    const VertexId v = map.surface.faces.data()[c];
    for (std::size_t i = 0; i < request.boundary_loop.size(); ++i) {
      if (request.boundary_loop[i] != v) continue;
      EXPECT_EQ(map.uv.row(c).transpose(), request.boundary_uv[i]);
    }
    for (const PinnedVertex& p : request.points) {
      if (p.vertex != v) continue;
      EXPECT_EQ(map.uv.row(c).transpose(), p.uv);
    }
  }
}

TEST(MoveOutline, SquareOntoANarrowSpiralWithUsefulEnergyAndTheSameBitsForAnyThreads) {
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
}

TEST(MoveOutline, CancelledOnTheWay) {
  const mesh::Surface surface = test::grid(16, 16);
  MatchOptions options;
  options.engine = MatchEngine::kOutline;
  ExecutionContext context;
  context.cancel();
  EXPECT_THROW(match(surface, wound(surface, 1.75, 0.3, 0.6), options, context), Cancelled);
}

// A band wound 1.4 times that drifts by less than its width: its ends lie over each other.
MatchRequest overlapping_band(const mesh::Surface& surface) {
  return wound(surface, 1.4, 1.0, 0.3);
}

TEST(MoveOutline, PinsOfAnOverlappingTargetLieOnTheOnlySheetOrTheOneTheirPathLeadsTo) {
  const mesh::Surface surface = test::grid(12, 12);
  MatchRequest request = overlapping_band(surface);
  const auto columns = VertexId{13};
  // Half way round, where there is one sheet.
  request.points = {{6 * columns + 6, {-1.7, 0.0}}};
  ExecutionContext context;
  const certify::Parametrization once = match(surface, request, {}, context);
  expect_met(once, request);
  EXPECT_GT(once.certificate.overlaps, 0);
  // Where there are two.
  const Vector2 both = 1.75 * Vector2(std::cos(0.6), std::sin(0.6));
  request.points = {{6 * columns + 6, both}};
  EXPECT_THROW(match(surface, request, {}, context), InvalidInput);
  // A straight path to the boundary, at whose other end there is one of them.
  const std::size_t n = request.boundary_loop.size();
  int reached = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const VertexId b = request.boundary_loop[i];
    if ((request.boundary_uv[i] - both).norm() > 0.7) continue;
    const Index column = b % columns;
    const Index row = b / columns;
    std::vector<VertexId> path = {6 * columns + 6};
    for (Index r = 6, c = 6; r != row || c != column;) {
      if (c != column) {
        c += c < column ? 1 : -1;
      } else {
        r += r < row ? 1 : -1;
      }
      path.push_back(r * columns + c);
      if (r == 0 || c == 0 || r == columns - 1 || c == columns - 1) break;
    }
    if (path.back() != b) continue;
    request.paths = {path};
    try {
      expect_met(match(surface, request, {}, context), request);
      ++reached;
    } catch (const Infeasible&) {
      continue;  // not seen from there
    }
    if (reached == 2) break;
  }
  EXPECT_EQ(reached, 2);
}

TEST(MoveOutline, ALineInAnOverlappingTargetIsLaidExactly) {
  const mesh::Surface surface = test::grid(12, 12);
  MatchRequest request = overlapping_band(surface);
  const auto columns = VertexId{13};
  PinnedLine line;
  for (VertexId i = 4; i <= 8; ++i) {
    line.vertices.push_back(6 * columns + i);
    line.polyline.emplace_back(-1.7, -0.2 + 0.1 * (i - 4));
  }
  request.lines = {line};
  ExecutionContext context;
  const certify::Parametrization map = match(surface, request, {}, context);
  for (std::size_t i = 0; i < line.vertices.size(); ++i)
    request.points.push_back({line.vertices[i], request.lines[0].polyline[i]});
  expect_met(map, request);
}

TEST(MoveOutline, MovableBoundaryVerticesLowerTheEnergyAndOthersStay) {
  const mesh::Surface surface = test::grid(10, 10);
  MatchRequest request;
  request.boundary_loop = boundary_of(surface);
  // A square whose bottom side is dented.
  for (const VertexId v : request.boundary_loop) {
    const double x = surface.vertices(v, 0);
    const double y = surface.vertices(v, 1);
    request.boundary_uv.emplace_back(x, y == 0 ? 0.5 * std::sin(std::numbers::pi * x) : y);
  }
  ExecutionContext context;
  const certify::Parametrization held = match(surface, request, {}, context);
  for (std::size_t i = 0; i < request.boundary_loop.size(); ++i) {
    const VertexId v = request.boundary_loop[i];
    if (surface.vertices(v, 1) == 0 && surface.vertices(v, 0) != 0 && surface.vertices(v, 0) != 1)
      request.movable.push_back(v);
  }
  const certify::Parametrization moved = match(surface, request, {}, context);
  EXPECT_TRUE(moved.certificate.ok);
  EXPECT_EQ(moved.certificate.overlaps, 0);
  EXPECT_LT(moved.certificate.energy, 0.9 * held.certificate.energy);
  for (CornerId c = 0; c < surface.faces.size(); ++c) {
    const VertexId v = moved.surface.faces.data()[c];
    for (std::size_t i = 0; i < request.boundary_loop.size(); ++i) {
      if (request.boundary_loop[i] != v || surface.vertices(v, 1) == 0) continue;
      EXPECT_EQ(moved.uv.row(c).transpose(), request.boundary_uv[i]);
    }
  }
  request.movable = {5 * 11 + 5};
  EXPECT_THROW(match(surface, request, {}, context), InvalidInput);
}

}  // namespace
}  // namespace flipfree::matchmaker::move_outline_test
