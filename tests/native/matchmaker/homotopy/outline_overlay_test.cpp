#include "flipfree/matchmaker/homotopy/outline_overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "flipfree/matchmaker/match.h"
#include "flipfree/matchmaker/paths/tracing_order.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::outline_overlay_test {
namespace {

// Centres of the cells in the order in which Hilbert's curve visits them.
Polygon hilbert(Index order) {
  Polygon points = {{0, 0}};
  for (Index level = 0; level < order; ++level) {
    const double size = std::exp2(level);
    Polygon next;
    for (const Vector2& p : points) next.emplace_back(p.y(), p.x());
    for (const Vector2& p : points) next.emplace_back(p.x(), p.y() + size);
    for (const Vector2& p : points) next.emplace_back(p.x() + size, p.y() + size);
    for (const Vector2& p : points) next.emplace_back(2 * size - 1 - p.y(), size - 1 - p.x());
    points = next;
  }
  return points;
}

// The outline of the curve thickened to half a cell, counter-clockwise, two corners per cell.
Polygon thickened(const Polygon& centres) {
  const std::size_t n = centres.size();
  Polygon left;
  Polygon outline;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2 first = i > 0 ? centres[i] - centres[i - 1] : centres[1] - centres[0];
    const Vector2 second = i + 1 < n ? centres[i + 1] - centres[i] : first;
    const Vector2 normal(-first.y() - second.y(), first.x() + second.x());
    const Vector2 offset = 0.25 * (first == second ? Vector2(normal / 2) : normal);
    outline.push_back(centres[i] - offset);
    left.push_back(centres[i] + offset);
  }
  outline.insert(outline.end(), left.rbegin(), left.rend());
  return outline;
}

std::vector<VertexId> boundary_of(const mesh::Surface& surface) {
  return mesh::make_refined_surface(surface).boundary;
}

// The outline, corners first, its longest sides halved until there are `count` points.
Polygon sampled(Polygon outline, std::size_t count) {
  while (outline.size() < count) {
    const auto length = [&](std::size_t i) {
      return (outline[(i + 1) % outline.size()] - outline[i]).squaredNorm();
    };
    std::size_t longest = 0;
    for (std::size_t i = 1; i < outline.size(); ++i) {
      if (length(i) > length(longest)) longest = i;
    }
    const Vector2 middle = 0.5 * (outline[longest] + outline[(longest + 1) % outline.size()]);
    outline.insert(outline.begin() + static_cast<std::ptrdiff_t>(longest) + 1, middle);
  }
  return outline;
}

// Three inner vertices of a grid far from each other into cells that are as far along the curve, in
// another order.
MatchRequest space_filling(const mesh::Surface& surface, Index columns, Index order) {
  MatchRequest request;
  request.boundary_loop = boundary_of(surface);
  const Polygon centres = hilbert(order);
  request.boundary_uv = sampled(thickened(centres), request.boundary_loop.size());
  const Index row = columns + 1;
  const std::size_t cells = centres.size();
  request.points = {{row * (columns / 4) + columns / 3, centres[cells / 2] + Vector2(0.1, 0.05)},
                    {row * (columns / 2) + columns / 2, centres[cells / 7]},
                    {row * (3 * columns / 4) + columns / 4, centres[6 * cells / 7]}};
  return request;
}

void expect_met(const certify::Parametrization& map, const MatchRequest& request) {
  EXPECT_TRUE(map.certificate.ok);
  std::size_t met = 0;
  for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
    const VertexId v = map.surface.faces.data()[c];
    const auto at = std::find(request.boundary_loop.begin(), request.boundary_loop.end(), v);
    if (at != request.boundary_loop.end()) {
      EXPECT_EQ(map.uv.row(c).transpose(),
                request.boundary_uv[static_cast<std::size_t>(at - request.boundary_loop.begin())]);
    }
    for (const PinnedVertex& p : request.points) {
      if (p.vertex != v) continue;
      EXPECT_EQ(map.uv.row(c).transpose(), p.uv);
      ++met;
    }
  }
  EXPECT_GE(met, request.points.size());
}

TEST(OutlineOverlay, AGridFillsHilbertsCurveOfOrderThreeWithThreePins) {
  const mesh::Surface surface = test::grid(32, 32);
  const MatchRequest request = space_filling(surface, 32, 3);
  ExecutionContext context;
  const certify::Parametrization map = match(surface, request, {}, context);
  expect_met(map, request);
  EXPECT_EQ(std::get<std::string>(map.stats.at("engine")), "outline overlay");
  // Crossings, not powers of two: the straight lines cross each of the surface's edges a few times.
  EXPECT_LT(std::get<std::int64_t>(map.stats.at("matchmaker.added_vertices")),
            8 * surface.vertices.rows());
}

TEST(OutlineOverlay, SameBitsForAnyNumberOfThreads) {
  const mesh::Surface surface = test::grid(12, 12);
  const MatchRequest request = space_filling(surface, 12, 2);
  MatchOptions options;
  options.engine = MatchEngine::kOverlay;
  ExecutionContext one;
  one.threads = 1;
  ExecutionContext two;
  two.threads = 2;
  const certify::Parametrization a = match(surface, request, options, one);
  const certify::Parametrization b = match(surface, request, options, two);
  expect_met(a, request);
  EXPECT_EQ(a.surface.faces, b.surface.faces);
  EXPECT_EQ(a.uv, b.uv);
}

TEST(OutlineOverlay, MatchmakerAloneStaysSmallToo) {
  const mesh::Surface surface = test::grid(16, 16);
  const MatchRequest request = space_filling(surface, 16, 2);
  MatchOptions options;
  options.engine = MatchEngine::kMatchmaker;
  ExecutionContext context;
  const certify::Parametrization map = match(surface, request, options, context);
  expect_met(map, request);
  EXPECT_LT(std::get<std::int64_t>(map.stats.at("matchmaker.added_vertices")),
            20 * surface.vertices.rows());
}

TEST(TracingOrder, EveryInnerEdgeOnceAndTheFirstOneHalvesTheSnake) {
  const Polygon outline = thickened(hilbert(3));
  const TargetDomain domain = triangulate_embedded(outline, {}, {});
  const ConvexPartition partition = merge_convex(domain);
  const std::vector<Index> order =
      tracing_order(domain, partition, std::vector<bool>(partition.edges.size(), false));
  std::vector<Index> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(std::adjacent_find(sorted.begin(), sorted.end()), sorted.end());
  EXPECT_EQ(order.size() + outline.size(), partition.edges.size());
  EXPECT_EQ(order.size() + 1, partition.polygons.size());
  // Polygons that hang together without the first edge.
  std::vector<char> reached(partition.polygons.size(), 0);
  std::vector<std::size_t> open = {0};
  reached[0] = 1;
  for (std::size_t i = 0; i < open.size(); ++i) {
    for (const auto& side : partition.polygons[open[i]]) {
      if (side.edge == order.front()) continue;
      for (std::size_t p = 0; p < partition.polygons.size(); ++p) {
        const auto& sides = partition.polygons[p];
        const bool beside = std::any_of(sides.begin(), sides.end(),
                                        [&](const auto& s) { return s.edge == side.edge; });
        if (!beside || reached[p] != 0) continue;
        reached[p] = 1;
        open.push_back(p);
      }
    }
  }
  EXPECT_GT(open.size(), partition.polygons.size() / 3);
  EXPECT_LT(open.size(), partition.polygons.size() - partition.polygons.size() / 3);
}

}  // namespace
}  // namespace flipfree::matchmaker::outline_overlay_test
