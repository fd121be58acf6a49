// Constraints are met bit for bit by a certified map, whatever they are and whichever engine makes
// it; those that no map meets are refused with a witness.
#include "flipfree/matchmaker/match.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"
#include "matchmaker/requests.h"

namespace flipfree::matchmaker::match_test {
namespace {

using test::boundary_of;
using test::expect_met;
using test::random_pins;

certify::Parametrization matched(const mesh::Surface& surface, const MatchRequest& request,
                                 MatchEngine engine = MatchEngine::kAuto) {
  ExecutionContext context;
  MatchOptions options;
  options.engine = engine;
  return match(surface, request, options, context);
}

// Twelve vertices of a grid change places.
MatchRequest exchange(const mesh::Surface& grid, Index side) {
  MatchRequest request;
  const auto vertex = [&](Index k) { return (side + 1) * (4 + 5 * (k / 3)) + 5 + 7 * (k % 3); };
  for (Index i = 0; i < 12; ++i) {
    const Vector2 other = grid.vertices.row(vertex((5 * i + 3) % 12)).head<2>();
    request.points.push_back({vertex(i), other + Vector2(0.0123, 0.0077)});
  }
  return request;
}

MatchRequest exchange_in_its_outline(const mesh::Surface& grid, Index side) {
  MatchRequest request = exchange(grid, side);
  test::hold_as_it_is(grid, request);
  return request;
}

MatchRequest three_in_a_circle(const mesh::Surface& grid, Index side) {
  const Index n = side + 1;
  MatchRequest request;
  test::hold_boundary(
      grid, [](double) { return 1.0; }, request);
  request.points = {{n * (side / 2) + side / 3, {0.4, 0.1}},
                    {n * (side / 2) + side - 2, {-0.4, 0}}};
  return request;
}

// An outline of three lobes, which is not convex.
MatchRequest leaf(const mesh::Surface& grid, Index) {
  MatchRequest request;
  test::hold_boundary(
      grid, [](double angle) { return 1 + 0.4 * std::cos(3 * angle); }, request);
  return request;
}

MatchRequest three_in_a_leaf(const mesh::Surface& grid, Index side) {
  MatchRequest request = leaf(grid, side);
  const Index row = side + 1;
  request.points = {
      {row * 5 + 3, {0.4, 0.1}}, {row * 5 + 7, {-0.3, 0.0}}, {row * 3 + 5, {0.0, 0.3}}};
  return request;
}

// Inner vertices stirred about the centre of a circle on which the boundary is held.
MatchRequest thirty_stirred(const mesh::Surface& grid, Index) {
  const std::vector<VertexId> loop = boundary_of(grid);
  MatchRequest request = random_pins(grid, 30, 7, loop);
  for (PinnedVertex& pin : request.points) {
    const Vector2 p =
        3.0 * (grid.vertices.row(pin.vertex).head<2>().transpose() - Vector2(0.5, 0.5));
    const double c = std::cos(3.0 * std::exp(-p.squaredNorm()));
    const double s = std::sin(3.0 * std::exp(-p.squaredNorm()));
    pin.uv = 0.8 * (Vector2(c * p.x() - s * p.y(), s * p.x() + c * p.y()) + 0.2 * pin.uv);
  }
  request.boundary_loop = loop;
  for (const VertexId v : loop) {
    const Vector2 p = grid.vertices.row(v).head<2>().transpose() - Vector2(0.5, 0.5);
    request.boundary_uv.emplace_back(2.0 * p.normalized());
  }
  return request;
}

MatchRequest twenty_anywhere(const mesh::Surface& grid, Index) {
  return random_pins(grid, 20, 100);
}

MatchRequest two_that_move_a_little(const mesh::Surface&, Index side) {
  const Index row = side + 1;
  MatchRequest request;
  request.points = {{row * (2 * side / 7) + 2 * side / 7, {0.31, 0.3}},
                    {row * (5 * side / 7) + 5 * side / 7, {0.69, 0.72}}};
  return request;
}

struct Case {
  const char* name;
  Index side;  // squares of the grid
  MatchRequest (*request)(const mesh::Surface& grid, Index side);
  MatchEngine engine;
  double most;  // vertices afterwards, in times of those before; 0: any number
};

const Case kCases[] = {
    {"exchange_by_arms", 24, exchange, MatchEngine::kArms, 1.3},
    {"exchange", 24, exchange, MatchEngine::kAuto, 1.3},
    {"exchange_in_its_outline", 24, exchange_in_its_outline, MatchEngine::kAuto, 2},
    {"circle", 10, three_in_a_circle, MatchEngine::kAuto, 1},
    {"circle_by_matchmaker", 10, three_in_a_circle, MatchEngine::kMatchmaker, 0},
    {"leaf", 10, leaf, MatchEngine::kFirstTry, 1},
    {"leaf_by_homotopy", 10, leaf, MatchEngine::kOutline, 1},
    {"leaf_by_matchmaker_takes_its_refinement_back", 10, leaf, MatchEngine::kMatchmaker, 1},
    {"pins_in_a_leaf", 10, three_in_a_leaf, MatchEngine::kAuto, 2},
    {"pins_in_a_leaf_by_matchmaker", 10, three_in_a_leaf, MatchEngine::kMatchmaker, 0},
    {"thirty_in_a_circle", 24, thirty_stirred, MatchEngine::kAuto, 3},
    {"twenty_anywhere", 30, twenty_anywhere, MatchEngine::kAuto, 2},
    {"near_places_add_nothing", 10, two_that_move_a_little, MatchEngine::kAuto, 1},
    {"near_places_on_a_large_surface", 70, two_that_move_a_little, MatchEngine::kAuto, 1},
};

class Constraint : public testing::TestWithParam<Case> {};

TEST_P(Constraint, is_met_bit_for_bit_by_a_certified_map) {
  const Case& given = GetParam();
  const mesh::Surface surface = test::bumpy_grid(given.side, given.side, 0.15, 3);
  const MatchRequest request = given.request(surface, given.side);
  const certify::Parametrization map = matched(surface, request, given.engine);
  expect_met(map, request);
  EXPECT_EQ(map.surface.vertices.topRows(surface.vertices.rows()), surface.vertices);
  if (given.most > 0) {
    EXPECT_LE(static_cast<double>(map.surface.vertices.rows()),
              given.most * static_cast<double>(surface.vertices.rows()));
  }
}

INSTANTIATE_TEST_SUITE_P(Match, Constraint, testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.name; });

// A box around such pins has no corners among doubles, and exact predicates no sign.
TEST(Match, TargetsBeyondWhatUVsStoreAreRefusedAndNamed) {
  const mesh::Surface surface = test::grid(6, 6);
  const double largest = std::numeric_limits<float>::max();
  const auto expect_refused = [&](const MatchRequest& request, const std::vector<Index>& named) {
    try {
      matched(surface, request);
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
    test::hold_as_it_is(surface, boundary);
    boundary.boundary_uv[3].x() = far;
    expect_refused(boundary, {boundary_of(surface)[3]});
  }
}

}  // namespace
}  // namespace flipfree::matchmaker::match_test
