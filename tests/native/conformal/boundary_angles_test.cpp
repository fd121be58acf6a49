#include "flipfree/conformal/boundary_angles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::conformal::boundary_angles_test {
namespace {

using std::numbers::pi;

void expect_gauss_bonnet(const mesh::Surface& surface, const std::vector<double>& angles) {
  const double sum = std::accumulate(angles.begin(), angles.end(), 0.0);
  EXPECT_NEAR(sum, pi * static_cast<double>(surface.faces.rows()), 1e-9);
}

TEST(BoundaryAngles, AStraightBoundaryTurnsAtItsCornersAlone) {
  const mesh::Surface surface = test::bumpy_grid(6, 4, 0.2, 1.0);
  ExecutionContext context;
  BoundaryAnglesOptions options;
  options.shape = BoundaryGoal::kStraight;
  options.corners = {0, 6, 28, 34};
  const std::vector<double> angles = boundary_angles(surface, options, context);
  expect_gauss_bonnet(surface, angles);
  for (const std::size_t corner : {0u, 6u, 28u, 34u}) EXPECT_NEAR(angles[corner], 0.5 * pi, 1e-12);
  EXPECT_NEAR(angles[3], pi, 1e-12);
  EXPECT_NEAR(angles[16], 2.0 * pi, 1e-12);
}

TEST(BoundaryAngles, FreeAndRoundBoundariesMeetGaussBonnetWithACone) {
  const mesh::Surface surface = test::bumpy_grid(8, 7, 0.3, 2.0);
  for (const BoundaryGoal goal : {BoundaryGoal::kFree, BoundaryGoal::kCircle}) {
    ExecutionContext context;
    BoundaryAnglesOptions options;
    options.shape = goal;
    options.cones = {{30, 1.5 * pi}};
    const std::vector<double> angles = boundary_angles(surface, options, context);
    expect_gauss_bonnet(surface, angles);
    EXPECT_NEAR(angles[30], 1.5 * pi, 1e-12);
  }
}

TEST(BoundaryAngles, AFlatDiskKeepsItsOwnAnglesWhereTheBoundaryIsFree) {
  const mesh::Surface surface = test::grid(5, 4);
  ExecutionContext context;
  const std::vector<double> angles = boundary_angles(surface, {}, context);
  EXPECT_NEAR(angles[0], 0.5 * pi, 1e-9);
  EXPECT_NEAR(angles[2], pi, 1e-9);
}

TEST(BoundaryAngles, ConesOfAClosedSurfaceThatDoNotAddUpAreInfeasible) {
  ExecutionContext context;
  BoundaryAnglesOptions options;
  options.cones = {{0, pi}};
  EXPECT_THROW(boundary_angles(test::sphere(8, 6), options, context), Infeasible);
  options.cones = {{0, -pi}};
  EXPECT_THROW(boundary_angles(test::sphere(8, 6), options, context), InvalidInput);
}

TEST(CloseGaussBonnet, MovesAnglesByRoundingOnly) {
  std::vector<double> angles(20, 2.0 * pi);  // of a torus
  angles[3] += 1e-11;
  close_gauss_bonnet(angles, std::vector<bool>(20, false), 0, 1e-9);
  EXPECT_NEAR(std::accumulate(angles.begin(), angles.end(), 0.0), 40.0 * pi, 1e-12);
  angles[3] += 0.1;
  EXPECT_THROW(close_gauss_bonnet(angles, std::vector<bool>(20, false), 0, 1e-9), Infeasible);
  EXPECT_THROW(close_measured_angles(angles, std::vector<bool>(20, false), 0, 1e-9), NotConverged);
}

}  // namespace
}  // namespace flipfree::conformal::boundary_angles_test
