// Disks with straight boundary: the angles are met, near to the disk's own metric.
#include "flipfree/seamless/padding/disks/disk_metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::seamless::disk_metric_test {
namespace {

constexpr double kPi = std::numbers::pi;

// Right angles at the corners of a grid, pi along its sides.
std::vector<double> square_angles(const mesh::Surface& surface, Index columns, Index rows) {
  std::vector<double> angle(static_cast<std::size_t>(surface.vertices.rows()), 2.0 * kPi);
  const auto adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  for (std::size_t h = 0; h < adjacency.opposite.size(); ++h) {
    if (adjacency.opposite[h] != kInvalid) continue;
    angle[static_cast<std::size_t>(mesh::source(surface.faces, static_cast<HalfedgeId>(h)))] = kPi;
  }
  const Index right = columns, top = rows * (columns + 1);
  for (const Index corner : {Index{0}, right, top, top + right})
    angle[static_cast<std::size_t>(corner)] = 0.5 * kPi;
  return angle;
}

TEST(DiskMetric, MeetsTheAnglesOfARectangle) {
  const mesh::Surface surface = test::bumpy_grid(12, 9, 0.3, 3.0);
  ExecutionContext context;
  const auto metric = compute_disk_metric(surface, square_angles(surface, 12, 9), context);
  EXPECT_LE(metric.angle_error, 1e-10);
  EXPECT_EQ(intrinsic::find_broken_invariant(metric), "");
}

TEST(DiskMetric, LeavesWhatIsFlatAlready) {
  const mesh::Surface surface = test::grid(6, 6);
  ExecutionContext context;
  const auto metric = compute_disk_metric(surface, square_angles(surface, 6, 6), context);
  const std::vector<double> length = intrinsic::to_doubles(metric.length);
  const std::vector<double> before = intrinsic::to_doubles(metric.initial_length);
  ASSERT_TRUE(metric.flips.empty());
  for (std::size_t e = 0; e < length.size(); ++e)
    EXPECT_NEAR(length[e] / before[e], length[0] / before[0], 1e-9);
}

}  // namespace
}  // namespace flipfree::seamless::disk_metric_test
