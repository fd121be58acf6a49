#include "flipfree/matchmaker/request/constraints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::constraints_test {
namespace {

// A grid of 7 x 7 vertices; the boundary, where it is asked for, on a circle around it.
class Request : public testing::Test {
 protected:
  Request() : surface_(test::grid(6, 6)), refined_(mesh::make_refined_surface(surface_)) {}

  void prescribe_circle() {
    const auto n = static_cast<double>(refined_.boundary.size());
    for (std::size_t i = 0; i < refined_.boundary.size(); ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / n;
      request_.boundary_uv.emplace_back(std::cos(angle), std::sin(angle));
    }
    request_.boundary_loop = refined_.boundary;
  }
  Constraints read() { return read_constraints(refined_, request_); }
  Error invalid() {
    try {
      (void)read();
    } catch (const InvalidInput& e) {
      return e.error();
    }
    ADD_FAILURE() << "accepted";
    return {};
  }
  Vector2 target_of(const Constraints& constraints, VertexId v) const {
    const auto pin = std::find_if(constraints.pins.begin(), constraints.pins.end(),
                                  [&](const PinnedVertex& p) { return p.vertex == v; });
    if (pin == constraints.pins.end()) {
      ADD_FAILURE() << v << " is not pinned";
      return Vector2::Zero();
    }
    return pin->uv;
  }

  mesh::Surface surface_;
  mesh::RefinedSurface refined_;
  MatchRequest request_;
};

TEST_F(Request, PinsComeInOrderOfTheirVerticesAndDoublesAreOne) {
  request_.points = {{30, {3, 0}}, {8, {0, 0}}, {30, {3, 0}}, {16, {1, 2}}};
  const Constraints constraints = read();
  ASSERT_EQ(constraints.pins.size(), 3U);
  EXPECT_EQ(constraints.pins[0].vertex, 8);
  EXPECT_EQ(constraints.pins[1].vertex, 16);
  EXPECT_EQ(constraints.pins[2].vertex, 30);
  EXPECT_TRUE(constraints.free_boundary());
  request_.points = {{49, {0, 0}}};
  EXPECT_EQ(invalid().code, ErrorCode::kIndexOutOfRange);
}

TEST_F(Request, TheBoundaryMayBeginAnywhereAndRunEitherWay) {
  prescribe_circle();
  const Polygon wanted = read().outline;
  EXPECT_EQ(wanted, request_.boundary_uv);
  std::rotate(request_.boundary_loop.begin(), request_.boundary_loop.begin() + 7,
              request_.boundary_loop.end());
  std::rotate(request_.boundary_uv.begin(), request_.boundary_uv.begin() + 7,
              request_.boundary_uv.end());
  EXPECT_EQ(read().outline, wanted);
  std::reverse(request_.boundary_loop.begin(), request_.boundary_loop.end());
  std::reverse(request_.boundary_uv.begin(), request_.boundary_uv.end());
  EXPECT_EQ(read().outline, wanted);
  std::swap(request_.boundary_loop[3], request_.boundary_loop[4]);
  EXPECT_EQ(invalid().code, ErrorCode::kBadBoundary);
  request_.boundary_loop.clear();
  request_.boundary_uv.pop_back();
  EXPECT_EQ(invalid().code, ErrorCode::kBadBoundary);
}

TEST_F(Request, APinOnThePrescribedBoundaryMustAgreeWithItAndIsNoPin) {
  prescribe_circle();
  request_.points = {{request_.boundary_loop[5], request_.boundary_uv[5]}};
  EXPECT_TRUE(read().pins.empty());
  request_.points[0].uv.x() += 0.25;
  EXPECT_THROW((void)read(), Infeasible);
}

TEST_F(Request, VerticesOfALineLieOnItsPointsOrAreSpreadBetweenThemByLength) {
  request_.lines = {{{15, 16, 17}, {{0, 0}, {1, 0.5}, {2, 0}}}};
  Constraints constraints = read();
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(target_of(constraints, request_.lines[0].vertices[i]), request_.lines[0].polyline[i]);
  EXPECT_EQ(constraints.edges, (std::vector<std::pair<VertexId, VertexId>>{{15, 16}, {16, 17}}));
  request_.lines = {{{15, 16, 17, 18, 19}, {{0, 0}, {8, 0}}}};
  constraints = read();
  for (VertexId v = 15; v <= 19; ++v)
    EXPECT_LT((target_of(constraints, v) - Vector2(2 * (v - 15), 0)).norm(), 1e-12);
}

TEST_F(Request, ALineWithMorePointsThanVerticesGetsMoreVertices) {
  const Index before = refined_.mesh.vertex_count();
  request_.lines = {{{15, 16}, {{0, 0}, {1, 1}, {2, 1}, {3, 0}}}};
  const Constraints constraints = read();
  EXPECT_EQ(refined_.mesh.vertex_count(), before + 2);
  ASSERT_EQ(constraints.edges.size(), 3U);
  Polygon laid = {target_of(constraints, constraints.edges[0].first)};
  for (const auto& [a, b] : constraints.edges) {
    EXPECT_NE(refined_.mesh.find(a, b), kInvalid);
    laid.push_back(target_of(constraints, b));
  }
  EXPECT_EQ(laid, request_.lines[0].polyline);
}

TEST_F(Request, LinesRunAlongEdgesAndHaveTwoEnds) {
  request_.lines = {{{15, 17}, {{0, 0}, {1, 0}}}};
  EXPECT_EQ(invalid().code, ErrorCode::kNotAnEdge);
  request_.lines = {{{15}, {{0, 0}, {1, 0}}}};
  EXPECT_EQ(invalid().code, ErrorCode::kBadPins);
  request_.lines = {{{15, 16}, {{0, 0}}}};
  EXPECT_EQ(invalid().code, ErrorCode::kBadPins);
}

TEST_F(Request, PathsRunFromAPinToThePrescribedBoundary) {
  prescribe_circle();
  request_.points = {{9, {0.1, 0.1}}};
  request_.paths = {{9, 2}};
  EXPECT_EQ(read().paths, request_.paths);
  request_.paths = {{10, 3}};
  EXPECT_EQ(invalid().code, ErrorCode::kBadPins);
  request_.paths = {{9, 16}};
  EXPECT_EQ(invalid().code, ErrorCode::kBadPins);
  request_.paths = {{9, 3}};
  EXPECT_EQ(invalid().code, ErrorCode::kNotAnEdge);
}

TEST_F(Request, MovableVerticesLieOnThePrescribedBoundaryAndAreNotPinned) {
  prescribe_circle();
  const VertexId v = request_.boundary_loop[4], w = request_.boundary_loop[2];
  request_.movable = {v, w};
  EXPECT_EQ(read().movable, (std::vector<VertexId>{std::min(v, w), std::max(v, w)}));
  request_.points = {{v, request_.boundary_uv[4]}};
  EXPECT_THROW((void)read(), Infeasible);
  request_.points.clear();
  request_.movable = {24};
  EXPECT_EQ(invalid().code, ErrorCode::kBadPins);
}

}  // namespace
}  // namespace flipfree::matchmaker::constraints_test
