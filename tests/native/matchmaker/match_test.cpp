#include "flipfree/matchmaker/match.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "flipfree/base/error.h"
#include "flipfree/mesh/topology.h"
#include "matchmaker/expect_met.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::match_test {
namespace {

MatchRequest random_pins(const mesh::Surface& surface, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<char> used(static_cast<std::size_t>(surface.vertices.rows()), 0);
  MatchRequest request;
  while (static_cast<int>(request.points.size()) < count) {
    const auto v = static_cast<VertexId>(random() % static_cast<unsigned>(surface.vertices.rows()));
    if (used[static_cast<std::size_t>(v)]++ != 0) continue;
    const auto coordinate = [&] { return static_cast<double>(random()) * 0x1p-32; };
    const double u = coordinate();
    request.points.push_back({v, {u, coordinate()}});
  }
  return request;
}

TEST(Match, RandomPinsAreMetBitForBitByEitherEngine) {
  const mesh::Surface surface = test::bumpy_grid(12, 12, 0.2, 3);
  for (const MatchEngine engine : {MatchEngine::kAuto, MatchEngine::kMatchmaker}) {
    for (unsigned seed = 0; seed < 3; ++seed) {
      for (const int count : {1, 2, 3, 8}) {
        ExecutionContext context;
        const MatchRequest request = random_pins(surface, count, seed);
        MatchOptions options;
        options.engine = engine;
        test::expect_met(match(surface, request, options, context), request);
      }
    }
  }
}

TEST(Match, SameBitsForAnyNumberOfThreads) {
  const mesh::Surface surface = test::bumpy_grid(12, 12, 0.2, 3);
  const MatchRequest request = random_pins(surface, 6, 5);
  ExecutionContext one;
  one.threads = 1;
  ExecutionContext two;
  two.threads = 2;
  const certify::Parametrization a = match(surface, request, {}, one);
  const certify::Parametrization b = match(surface, request, {}, two);
  ASSERT_EQ(a.uv.rows(), b.uv.rows());
  EXPECT_EQ(a.uv, b.uv);
}

std::vector<VertexId> boundary_of(const mesh::Surface& surface) {
  return mesh::boundary_loops(
             surface.faces,
             mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces))
      .front();
}

// Inner vertices stirred about the centre of a circle on which the boundary is held.
TEST(Match, ThirtyPinsInsideAPrescribedBoundaryArrive) {
  const mesh::Surface surface = test::bumpy_grid(24, 24, 0.15, 3);
  const std::vector<VertexId> loop = boundary_of(surface);
  MatchRequest request;
  request.boundary_loop = loop;
  for (const VertexId v : loop) {
    const Vector2 p = surface.vertices.row(v).head<2>().transpose() - Vector2(0.5, 0.5);
    request.boundary_uv.emplace_back(2.0 * p.normalized());
  }
  std::mt19937 random(7);
  std::vector<char> used(static_cast<std::size_t>(surface.vertices.rows()), 0);
  for (const VertexId v : loop) used[static_cast<std::size_t>(v)] = 1;
  const auto coordinate = [&] { return static_cast<double>(random()) * 0x1p-32; };
  while (request.points.size() < 30) {
    const auto v = static_cast<VertexId>(random() % static_cast<unsigned>(surface.vertices.rows()));
    if (used[static_cast<std::size_t>(v)]++ != 0) continue;
    const Vector2 p = 3.0 * (surface.vertices.row(v).head<2>().transpose() - Vector2(0.5, 0.5));
    const double turn = 3.0 * std::exp(-p.squaredNorm());
    const double u = std::cos(turn) * p.x() - std::sin(turn) * p.y() + 0.2 * coordinate();
    request.points.push_back({v, 0.8 * Vector2(u, std::sin(turn) * p.x() + std::cos(turn) * p.y() +
                                                      0.2 * coordinate())});
  }
  ExecutionContext context;
  const certify::Parametrization map = match(surface, request, {}, context);
  test::expect_met(map, request);
  EXPECT_LE(map.surface.faces.rows(), 3 * surface.faces.rows());
}

TEST(Match, TwentyPinsWithAFreeBoundaryArrive) {
  const mesh::Surface surface = test::bumpy_grid(30, 30, 0.15, 3);
  const MatchRequest request = random_pins(surface, 20, 100);
  ExecutionContext context;
  const certify::Parametrization map = match(surface, request, {}, context);
  test::expect_met(map, request);
  EXPECT_LE(map.surface.faces.rows(), 2 * surface.faces.rows());
}

TEST(Match, WholeBoundaryOnARibbonThatOverlapsItself) {
  const mesh::Surface surface = test::grid(40, 4);
  const std::vector<VertexId> loop = boundary_of(surface);
  MatchRequest request;
  request.boundary_loop = loop;
  for (const VertexId v : loop) {
    const double angle = 2 * std::numbers::pi * 1.5 * surface.vertices(v, 0);
    const double radius = 2 - surface.vertices(v, 1) + 0.3 * angle / (2 * std::numbers::pi);
    request.boundary_uv.emplace_back(-radius * std::cos(angle), radius * std::sin(angle));
  }
  for (const MatchEngine engine : {MatchEngine::kAuto, MatchEngine::kMatchmaker}) {
    ExecutionContext context;
    MatchOptions options;
    options.engine = engine;
    certify::Parametrization map;
    try {
      map = match(surface, request, options, context);
    } catch (const Infeasible&) {
      for (Vector2& uv : request.boundary_uv) uv.x() = -uv.x();
      map = match(surface, request, options, context);
    }
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_GT(map.certificate.overlaps, 0);
  }
}

TEST(Match, ContradictionsNameTheVertices) {
  const mesh::Surface surface = test::grid(6, 6);
  const std::vector<VertexId> loop = boundary_of(surface);
  const auto expect_contradiction = [&](const MatchRequest& request, ErrorCode code,
                                        std::vector<Index> named) {
    ExecutionContext context;
    MatchOptions options;
    options.bijective = true;
    try {
      match(surface, request, options, context);
      FAIL() << "accepted";
    } catch (const Infeasible& failure) {
      EXPECT_EQ(failure.error().code, code) << failure.what();
      EXPECT_FALSE(failure.error().witness.rule.empty());
      for (const Index v : named) {
        EXPECT_NE(std::find(failure.error().elements.begin(), failure.error().elements.end(), v),
                  failure.error().elements.end());
      }
    }
  };
  MatchRequest same;
  same.points = {{8, {0.5, 0.5}}, {16, {0.5, 0.5}}};
  expect_contradiction(same, ErrorCode::kContradictoryPins, {8, 16});
  // Two sheets of a map that may overlap itself could have them both: no proof.
  ExecutionContext context;
  EXPECT_THROW(match(surface, same, {}, context), NotConverged);

  MatchRequest crossing;
  crossing.lines = {{{8, 9}, {{0, 0}, {1, 1}}}, {{22, 23}, {{0, 1}, {1, 0}}}};
  expect_contradiction(crossing, ErrorCode::kContradictoryPins, {8, 9, 22, 23});

  MatchRequest clockwise;
  MatchRequest eight;
  MatchRequest outside;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const double t =
        2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(loop.size());
    clockwise.boundary_uv.emplace_back(std::cos(t), -std::sin(t));
    eight.boundary_uv.emplace_back(std::sin(2 * t + 0.1), std::sin(t + 0.05));
    outside.boundary_uv.emplace_back(std::cos(t), std::sin(t));
  }
  expect_contradiction(clockwise, ErrorCode::kContradictoryPins, {});
  expect_contradiction(eight, ErrorCode::kNotSelfOverlapping, {});
  outside.points = {{24, {3, 3}}};
  expect_contradiction(outside, ErrorCode::kContradictoryPins, {24});
}

// A box around such pins has no corners among doubles, and exact predicates no sign.
TEST(Match, TargetsBeyondWhatUVsStoreAreRefusedAndNamed) {
  const mesh::Surface surface = test::grid(6, 6);
  const double largest = std::numeric_limits<float>::max();
  const auto expect_refused = [&](const MatchRequest& request, const std::vector<Index>& named) {
    ExecutionContext context;
    try {
      match(surface, request, {}, context);
      FAIL() << "accepted";
    } catch (const InvalidInput& refusal) {
      EXPECT_EQ(refusal.error().code, ErrorCode::kNotFinite);
      EXPECT_EQ(refusal.error().elements, named);
    }
  };
  for (const double far :
       {std::nextafter(largest, 2 * largest), 1e300, std::numeric_limits<double>::max(),
        std::numeric_limits<double>::quiet_NaN()}) {
    MatchRequest pin;
    pin.points = {{8, {0, 0}}, {16, {1, far}}};
    expect_refused(pin, {16});
    MatchRequest line;
    line.lines = {{{8, 9}, {{0, 0}, {-far, 1}}}};
    expect_refused(line, {9});
    MatchRequest split = line;  // its middle point goes to a vertex that the line adds
    split.lines[0].polyline = {{0, 0}, {far, 0}, {1, 1}};
    expect_refused(split, {});
    MatchRequest boundary;
    for (const VertexId v : boundary_of(surface))
      boundary.boundary_uv.emplace_back(surface.vertices.row(v).head<2>().transpose());
    boundary.boundary_uv[3].x() = far;
    expect_refused(boundary, {boundary_of(surface)[3]});
  }
}

TEST(Match, LinesLieOnTheirPolylines) {
  const mesh::Surface surface = test::grid(10, 10);
  MatchRequest request;
  // Vertices 35 .. 41 run along a row; the polyline has a corner in the middle.
  request.lines = {{{35, 36, 37, 38, 39, 40, 41}, {{0, 0}, {0.5, 0.25}, {1, 0}}}};
  for (const MatchEngine engine : {MatchEngine::kAuto, MatchEngine::kMatchmaker}) {
    ExecutionContext context;
    MatchOptions options;
    options.engine = engine;
    const certify::Parametrization map = match(surface, request, options, context);
    EXPECT_TRUE(map.certificate.ok);
    for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
      const VertexId v = map.surface.faces.data()[c];
      if (v == 38) {
        EXPECT_EQ(map.uv.row(c).transpose(), Vector2(0.5, 0.25));
      } else if (v == 41) {
        EXPECT_EQ(map.uv.row(c).transpose(), Vector2(1, 0));
      }
    }
  }
}

TEST(Match, CancelsWithoutAResult) {
  const mesh::Surface surface = test::bumpy_grid(30, 30, 0.2, 3);
  const MatchRequest request = random_pins(surface, 10, 1);
  ExecutionContext context;
  context.cancel();
  EXPECT_THROW(match(surface, request, {}, context), Cancelled);
}

}  // namespace
}  // namespace flipfree::matchmaker::match_test
