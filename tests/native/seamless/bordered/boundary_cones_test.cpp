#include "flipfree/seamless/bordered/corners.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "flipfree/mesh/topology.h"
#include "support/shapes.h"

namespace flipfree::seamless::boundary_cones_test {
namespace {

// 4 inside, nothing at the boundary.
std::vector<Index> no_wishes(const mesh::Surface& surface) {
  std::vector<Index> cones(at(static_cast<Index>(surface.vertices.rows())), 4);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(cones.size()), surface.faces);
  for (const auto& loop : mesh::boundary_loops(surface.faces, adjacency)) {
    for (const VertexId v : loop) cones[at(v)] = kNotGiven;
  }
  return cones;
}

Index count_of(const std::vector<Index>& cones, Index k) {
  return static_cast<Index>(std::count(cones.begin(), cones.end(), k));
}

std::vector<Index> corners_of(const mesh::Surface& surface, const std::vector<Index>& cones) {
  ExecutionContext context;
  return aligned_cones(surface, cones, context);
}

TEST(FlatInside, WhatIsNotGivenIsFlatAwayFromTheBoundary) {
  const mesh::Surface square = test::grid(2, 2);
  const mesh::Adjacency adjacency = mesh::build_adjacency(9, square.faces);
  EXPECT_EQ(flat_inside(std::vector<Index>(9, kNotGiven), adjacency),
            (std::vector<Index>{0, 0, 0, 0, 4, 0, 0, 0, 0}));
}

TEST(AlignedCones, CornersOfASquareAreFound) {
  const mesh::Surface square = test::bumpy_grid(6, 6, 0.1, 2.0);
  const auto cones = corners_of(square, no_wishes(square));
  for (const Index v : {0, 6, 42, 48}) EXPECT_EQ(cones[at(v)], 1) << v;
  EXPECT_EQ(count_of(cones, 1), 4);
  EXPECT_EQ(count_of(cones, 2), 20);
}

TEST(AlignedCones, ASmoothBoundaryIsDividedEvenly) {
  const mesh::Surface tube = test::tube(16, 3);  // closed at one end: turns by four quarters
  const auto cones = corners_of(tube, no_wishes(tube));
  std::vector<Index> corners;
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(cones.size()), tube.faces);
  const auto loop = mesh::boundary_loops(tube.faces, adjacency).front();
  for (std::size_t i = 0; i < loop.size(); ++i) {
    if (cones[at(loop[i])] == 1) corners.push_back(static_cast<Index>(i));
  }
  ASSERT_EQ(corners.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(corners[i] - corners[i - 1], 4);
}

TEST(AlignedCones, ATubeNeedsNoCorners) {
  const mesh::Surface cylinder = test::cylinder(12, 4);
  EXPECT_EQ(count_of(corners_of(cylinder, no_wishes(cylinder)), 2), 24);
}

TEST(AlignedCones, AreThoseOfTheShapeInAnyUnit) {
  const mesh::Surface square = test::bumpy_grid(6, 6, 0.1, 2.0);
  const auto cones = corners_of(square, no_wishes(square));
  for (const double unit : {1e-300, 1e-200, 1e-60, 1e60, 1e150, 1e300}) {
    mesh::Surface scaled = square;
    scaled.vertices *= unit;
    EXPECT_EQ(corners_of(scaled, no_wishes(scaled)), cones) << unit;
  }
}

TEST(AlignedCones, GivenCornersLeaveTheOthersStraight) {
  const mesh::Surface square = test::grid(4, 4);
  auto cones = no_wishes(square);
  for (const Index v : {1, 3, 21, 23}) cones[at(v)] = 1;
  const auto all = corners_of(square, cones);
  EXPECT_EQ(count_of(all, 1), 4);
  EXPECT_EQ(count_of(all, kNotGiven), 0);
  cones[1] = 3;
  try {
    corners_of(square, cones);
    ADD_FAILURE() << "Gauss-Bonnet was not asked";
  } catch (const Infeasible& error) {
    EXPECT_EQ(error.error().code, ErrorCode::kGaussBonnet);
  }
}

TEST(AlignedCones, ATriangleCannotHaveFourCorners) {
  const mesh::Surface triangle = test::stacked(12, test::Stacking::kRandom);
  EXPECT_THROW(corners_of(triangle, no_wishes(triangle)), Infeasible);
}

TEST(FreeAngles, EachCurveTurnsByWholeQuarters) {
  mesh::Surface cylinder = test::cylinder(12, 4);
  for (Eigen::Index v = 0; v < cylinder.vertices.rows(); ++v)
    cylinder.vertices.row(v).head<2>() *= 1.0 + 0.3 * cylinder.vertices(v, 2);
  ExecutionContext context;
  const auto angles = free_angles(cylinder, no_wishes(cylinder), Boundary::kFree, context);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(angles.size()), cylinder.faces);
  for (const auto& loop : mesh::boundary_loops(cylinder.faces, adjacency)) {
    double turning = 0.0;
    for (const VertexId v : loop) turning += std::numbers::pi - angles[at(v)];
    const double quarters = turning / (0.5 * std::numbers::pi);
    EXPECT_NEAR(quarters, std::round(quarters), 1e-9);
  }
}

TEST(FreeAngles, RefusesAnglesAtTheBoundary) {
  const mesh::Surface square = test::grid(4, 4);
  auto cones = no_wishes(square);
  cones[0] = 1;
  ExecutionContext context;
  EXPECT_THROW(free_angles(square, cones, Boundary::kFree, context), InvalidInput);
}

TEST(FreeAngles, CurvesTurnAsTheirCornersDoWhereverTheseAre) {
  const mesh::Surface cylinder = test::cylinder(12, 4);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(cylinder.vertices.rows()), cylinder.faces);
  const auto loops = mesh::boundary_loops(cylinder.faces, adjacency);
  ASSERT_EQ(loops.size(), 2U);
  std::vector<Index> cones(static_cast<std::size_t>(cylinder.vertices.rows()), 4);
  for (const auto& loop : loops) {
    for (const VertexId v : loop) cones[at(v)] = 2;
  }
  cones[at(loops[0][0])] = 0;  // no angle that a corner can have, but a sum that a curve can
  cones[at(loops[1][0])] = 4;
  ExecutionContext context;
  const auto angles = free_angles(cylinder, cones, Boundary::kTurning, context);
  for (std::size_t i = 0; i < 2; ++i) {
    double turning = 0.0;
    for (const VertexId v : loops[i]) turning += std::numbers::pi - angles[at(v)];
    EXPECT_NEAR(turning, i == 0 ? std::numbers::pi : -std::numbers::pi, 1e-9);
  }
  cones[at(loops[1][0])] = 3;
  EXPECT_THROW(free_angles(cylinder, cones, Boundary::kTurning, context), Infeasible);
}

TEST(PrescribedAngles, AreThoseOfInnerConesAndOfAnAlignedBoundary) {
  const mesh::Surface square = test::grid(2, 2);
  const std::vector<Index> cones = {1, 2, 1, 2, 3, 2, 1, 2, 1};
  const mesh::Adjacency adjacency = mesh::build_adjacency(9, square.faces);
  EXPECT_EQ(prescribed_angles(cones, square.faces, adjacency, true).size(), 9U);
  const auto inner = prescribed_angles(cones, square.faces, adjacency, false);
  ASSERT_EQ(inner.size(), 1U);
  EXPECT_DOUBLE_EQ(inner.front().second, 1.5 * std::numbers::pi);
  EXPECT_EQ(inner_cones(cones, square.faces, adjacency), std::vector<VertexId>{4});
}

}  // namespace
}  // namespace flipfree::seamless::boundary_cones_test
