#include "flipfree/unwrap/seams/costs.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/shapes.h"
#include "support/thread_seconds.h"

namespace flipfree::unwrap::exposure_test {
namespace {

std::vector<double> exposure_of(const mesh::Surface& surface, int threads = 1) {
  ExecutionContext context;
  context.threads = threads;
  return exposure(surface, context);
}

TEST(Exposure, of_a_ball_is_one_everywhere) {
  for (const double seen : exposure_of(test::sphere(48, 32))) EXPECT_NEAR(seen, 1.0, 0.2);
}

TEST(Exposure, is_less_inside_a_tube) {
  mesh::Surface tube = test::tube(32, 24);  // closed at the far end: nobody looks in from there
  tube.vertices *= 0.25;
  const std::vector<double> open = exposure_of(tube);
  double rim = 0.0;
  double end = 0.0;
  for (std::size_t v = 0; v < open.size(); ++v) {
    const bool at_rim = v < 32;
    (at_rim ? rim : end) += open[v] / (at_rim ? 32.0 : static_cast<double>(open.size() - 32));
  }
  EXPECT_GT(rim, end);
}

// A wall close behind another hides its face, and both their outer sides are seen.
TEST(Exposure, is_less_between_two_walls) {
  mesh::Surface walls = test::grid(12, 12);
  const Eigen::Index count = walls.vertices.rows();
  const Eigen::Index faces = walls.faces.rows();
  // A third in the middle is hidden from both sides.
  walls.vertices.conservativeResize(3 * count, 3);
  Triangles all = walls.faces.triangles().replicate(3, 1);
  for (Index k = 1; k < 3; ++k) {
    walls.vertices.middleRows(k * count, count) = walls.vertices.topRows(count);
    walls.vertices.middleRows(k * count, count).col(2).array() += 0.02 * k;
    all.middleRows(k * faces, faces).array() += static_cast<int>(k * count);
  }
  walls.faces = std::move(all);
  const std::vector<double> seen = exposure_of(walls);
  const auto middle = static_cast<std::size_t>(6 * 13 + 6);
  EXPECT_LT(seen[middle + static_cast<std::size_t>(count)], 0.2 * seen[middle]);
}

TEST(Exposure, is_less_at_the_back_of_what_has_a_face) {
  mesh::Surface head = test::sphere(96, 64);
  for (Eigen::Index v = 0; v < head.vertices.rows(); ++v) {
    const Vector3 p = head.vertices.row(v);
    if (p.x() > 0.3)
      head.vertices.row(v) *= 1.0 + 0.06 * std::sin(16.0 * p.y()) * std::sin(16.0 * p.z());
  }
  const std::vector<double> seen = exposure_of(head);
  double front = 0.0;
  double back = 0.0;
  int counted[2] = {0, 0};
  for (Eigen::Index v = 0; v < head.vertices.rows(); ++v) {
    const double x = head.vertices(v, 0);
    if (std::abs(x) < 0.7) continue;
    (x > 0.0 ? front : back) += seen[static_cast<std::size_t>(v)];
    ++counted[x > 0.0 ? 0 : 1];
  }
  EXPECT_GT(front / counted[0], 1.3 * back / counted[1]);
}

TEST(Exposure, does_not_depend_on_the_unit_the_place_or_the_number_of_threads) {
  mesh::Surface head = test::bumpy_grid(24, 24, 0.5, 2.0);
  const std::vector<double> seen = exposure_of(head);
  EXPECT_EQ(exposure_of(head, 4), seen);
  head.vertices *= 0x1p-1000;
  EXPECT_EQ(exposure_of(head), seen);
}

// Spokes are needles across the whole picture: their boxes overlap, and are not walked.
TEST(Exposure, of_spokes_takes_little_more_than_of_a_ball) {
  const auto seconds = [](const mesh::Surface& surface) {
    ExecutionContext context;
    context.threads = 1;
    const double begin = test::thread_seconds();
    exposure(surface, context);
    return test::thread_seconds() - begin;
  };
  EXPECT_LT(seconds(test::sphere(10000, 2)), 12.0 * seconds(test::sphere(100, 100)));
}

TEST(Exposure, of_what_has_no_area_is_one) {
  mesh::Surface point = test::tetrahedron();
  point.vertices.setZero();
  EXPECT_EQ(exposure_of(point), std::vector<double>(4, 1.0));
}

}  // namespace
}  // namespace flipfree::unwrap::exposure_test
