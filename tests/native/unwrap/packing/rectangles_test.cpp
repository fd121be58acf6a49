#include "flipfree/unwrap/packing/rectangles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "flipfree/base/error.h"

namespace flipfree::unwrap::pack_rectangles_test {
namespace {

// Rounding of a few operations on numbers of size one.
constexpr double kRounding = 1e-14;

std::vector<Vector2> rectangles(std::size_t count, double longest, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> side(0.01, 1.0);
  std::vector<Vector2> sizes;
  for (std::size_t i = 0; i < count; ++i) sizes.emplace_back(side(random), side(random) * longest);
  return sizes;
}

RoomOptions with_margin(double margin) {
  RoomOptions options;
  options.margin = margin;
  return options;
}

// The least distance between two packed rectangles, or one and the border of their tile; negative
// if they overlap.
double least_gap(const std::vector<Vector2>& sizes, const Placement& placement) {
  double least = std::numeric_limits<double>::infinity();
  const Vector2 tile(placement.tile % 10, placement.tile / 10);
  std::vector<std::array<double, 4>> boxes;  // low u, low v, -high u, -high v
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const Vector2 low = placement.corner[i] - tile, high = low + sizes[i] * placement.scale;
    least = std::min({least, low.minCoeff(), 1.0 - high.maxCoeff()});
    boxes.push_back({low[0], low[1], -high[0], -high[1]});
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double* a = boxes[i].data();
    for (std::size_t j = 0; j < i; ++j) {
      const double* b = boxes[j].data();
      double apart = a[0] + b[2];
      if (a[1] + b[3] > apart) apart = a[1] + b[3];
      if (b[0] + a[2] > apart) apart = b[0] + a[2];
      if (b[1] + a[3] > apart) apart = b[1] + a[3];
      if (apart < least) least = apart;
    }
  }
  return least;
}

using Triangle = std::array<Vector2, 3>;

Points2 corners_of(const std::vector<Triangle>& triangles) {
  Points2 corners(static_cast<Eigen::Index>(3 * triangles.size()), 2);
  Eigen::Index row = 0;
  for (const Triangle& t : triangles)
    for (const Vector2& p : t) corners.row(row++) = p.transpose();
  return corners;
}

// Whether the triangle comes within the box, by clipping it (Sutherland and Hodgman): shares
// nothing with the grid.
bool meets(const Triangle& triangle, const Vector2& low, const Vector2& high) {
  std::vector<Vector2> polygon(triangle.begin(), triangle.end());
  for (int axis = 0; axis < 2; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const double limit = sign > 0 ? low[axis] : -high[axis];
      std::vector<Vector2> inside;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vector2& p = polygon[i];
        const Vector2& q = polygon[(i + 1) % polygon.size()];
        const double a = sign * p[axis] - limit;
        const double b = sign * q[axis] - limit;
        if (a > 0) inside.push_back(p);
        if ((a > 0) != (b > 0)) inside.push_back(p + (a / (a - b)) * (q - p));
      }
      polygon = inside;
    }
  }
  return !polygon.empty();
}

void expect_clear(const std::vector<Triangle>& obstacles, const std::vector<Vector2>& sizes,
                  const Placement& placement, double margin) {
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const Vector2 gap = Vector2::Constant(margin - kRounding);
    const Vector2 low = placement.corner[i] - gap;
    const Vector2 high = placement.corner[i] + placement.scale * sizes[i] + gap;
    for (const Triangle& t : obstacles) EXPECT_FALSE(meets(t, low, high)) << "rectangle " << i;
  }
}

TEST(PackRectangles, keep_the_margin_in_the_final_square) {
  for (const double margin : {0.005, 0.02}) {
    for (const std::size_t count : {1U, 2U, 7U, 200U, 1500U, 2500U}) {
      for (const double longest : {1.0, 30.0}) {
        const std::vector<Vector2> sizes = rectangles(count, longest, 7);
        const double asked =
            std::min(margin, 0.9 / (std::ceil(std::sqrt(static_cast<double>(count))) + 1.0));
        EXPECT_GE(least_gap(sizes, pack_rectangles(sizes, with_margin(margin))), asked - kRounding)
            << count << " rectangles up to " << longest << ", margin " << margin;
      }
    }
  }
}

TEST(PackRectangles, are_apart_by_many_units_of_the_last_place_without_a_margin) {
  const std::vector<Vector2> sizes = rectangles(300, 1.0, 2);
  EXPECT_GE(least_gap(sizes, pack_rectangles(sizes, with_margin(0.0))), 64 * 0x1p-24);
}

TEST(PackRectangles, a_margin_without_room_is_lowered_instead_of_refused) {
  const std::vector<Vector2> sizes = rectangles(400, 1.0, 3);
  const Placement placement = pack_rectangles(sizes, with_margin(0.4));
  EXPECT_GE(least_gap(sizes, placement), 0.9 / 21.0 - kRounding);
  EXPECT_GT(placement.scale, 0.0);
}

TEST(PackRectangles, many_needles_have_room) {
  const std::vector<Vector2> sizes(20000, Vector2(1.0, 1e-9));
  EXPECT_GT(pack_rectangles(sizes, with_margin(0.3)).scale, 0.0);
}

TEST(PackRectangles, one_rectangle_fills_the_square) {
  const Placement placement = pack_rectangles({Vector2(4.0, 1.0)}, with_margin(0.01));
  EXPECT_NEAR(placement.scale, 0.98 / 4.0, 1e-9);
}

TEST(PackRectangles, equal_squares_fill_most_of_the_square) {
  const std::vector<Vector2> sizes(100, Vector2(1.0, 1.0));
  EXPECT_GE(pack_rectangles(sizes, with_margin(0.0)).scale, 0.1 / 1.002);
}

// Fill that was measured, less three hundredths.
TEST(PackRectangles, random_rectangles_fill_as_much_as_they_did) {
  const std::array<std::pair<std::size_t, double>, 5> cases = {
      {{8, 0.68}, {20, 0.79}, {100, 0.83}, {1000, 0.89}, {5000, 0.92}}};
  for (const auto& [count, least] : cases) {
    double fill = 0.0;
    constexpr unsigned kSets = 5;
    for (unsigned seed = 0; seed < kSets; ++seed) {
      const std::vector<Vector2> sizes = rectangles(count, 1.0, seed);
      const double scale = pack_rectangles(sizes, with_margin(0.0)).scale;
      for (const Vector2& size : sizes) fill += size.prod() * scale * scale / kSets;
    }
    EXPECT_GE(fill, least) << count << " rectangles";
  }
}

TEST(PackRectangles, without_size_are_placed_without_scaling) {
  const Placement placement = pack_rectangles({Vector2::Zero(), Vector2::Zero()}, with_margin(0.1));
  EXPECT_EQ(placement.scale, 1.0);
  EXPECT_TRUE(placement.corner[0].allFinite() && placement.corner[1].allFinite());
}

TEST(PackRectangles, a_scale_that_is_wanted_is_met_if_there_is_room_and_never_exceeded) {
  const std::vector<Vector2> sizes = rectangles(30, 1.0, 1);
  RoomOptions options;
  const double largest = pack_rectangles(sizes, options).scale;
  options.scale = 0.3 * largest;
  EXPECT_EQ(pack_rectangles(sizes, options).scale, options.scale);
  options.scale = 3.0 * largest;
  EXPECT_EQ(pack_rectangles(sizes, options).scale, largest);
}

TEST(PackRectangles, keep_clear_of_random_obstacles) {
  constexpr double kMargin = 0.004;
  int beside = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-0.3, 1.3);
    std::uniform_real_distribution<double> offset(-0.25, 0.25);
    std::vector<Triangle> obstacles(1 + seed % 12);
    for (Triangle& t : obstacles) {
      const Vector2 centre(place(random), place(random));
      for (Vector2& p : t) p = centre + Vector2(offset(random), offset(random));
    }
    if (seed % 3 == 0) obstacles[0][2] = obstacles[0][1];  // a segment
    const std::vector<Vector2> sizes = rectangles(1 + seed % 40, 1.0, seed);
    const Points2 corners = corners_of(obstacles);
    RoomOptions options = with_margin(kMargin);
    options.obstacles = &corners;
    const Placement placement = pack_rectangles(sizes, options);
    beside += placement.tile == 0;
    EXPECT_GE(least_gap(sizes, placement), kMargin - kRounding);
    expect_clear(obstacles, sizes, placement, kMargin);
  }
  EXPECT_GE(beside, 50);
}

// A ring with a hole: what is packed may lie inside the hole.
TEST(PackRectangles, the_hole_of_an_obstacle_is_room) {
  std::vector<Triangle> ring;
  const std::array<Vector2, 4> outer = {Vector2(-0.1, -0.1), {1.1, -0.1}, {1.1, 1.1}, {-0.1, 1.1}};
  const std::array<Vector2, 4> inner = {Vector2(0.2, 0.2), {0.8, 0.2}, {0.8, 0.8}, {0.2, 0.8}};
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t n = (k + 1) % 4;
    ring.push_back({outer[k], outer[n], inner[k]});
    ring.push_back({inner[n], inner[k], outer[n]});  // either orientation
    std::swap(ring.back()[0], ring.back()[1]);
  }
  const Points2 corners = corners_of(ring);
  RoomOptions options = with_margin(0.01);
  options.obstacles = &corners;
  const Placement placement = pack_rectangles({Vector2(1.0, 1.0)}, options);
  EXPECT_EQ(placement.tile, 0);
  EXPECT_GT(placement.scale, 0.57);
  expect_clear(ring, {Vector2(1.0, 1.0)}, placement, 0.01);
}

TEST(PackRectangles, full_tiles_are_passed_over_in_the_order_of_udim) {
  const auto tiles = [](int count) {
    std::vector<Triangle> obstacles;
    for (int i = 0; i < count; ++i) {
      const Vector2 low(i % 10, i / 10);
      const Vector2 right = low + Vector2(0.95, 0.0);
      const Vector2 top = low + Vector2(0.0, 1.0);
      obstacles.push_back({low, right, top});
      obstacles.push_back({right, right + Vector2(0.0, 1.0), top});
    }
    return obstacles;
  };
  const std::vector<Vector2> sizes = rectangles(9, 1.0, 4);
  for (const int full : {1, 3, 10, 25}) {
    const std::vector<Triangle> obstacles = tiles(full);
    const Points2 corners = corners_of(obstacles);
    RoomOptions options;
    options.obstacles = &corners;
    const Placement placement = pack_rectangles(sizes, options);
    EXPECT_EQ(placement.tile, full);
    EXPECT_GE(least_gap(sizes, placement), 0.005 - kRounding);
    expect_clear(obstacles, sizes, placement, 0.005);
  }
}

TEST(PackRectangles, no_room_anywhere_is_refused) {
  const Points2 corners = corners_of({{Vector2(-50.0, -50.0), {500.0, -50.0}, {-50.0, 500.0}}});
  RoomOptions options;
  options.obstacles = &corners;
  EXPECT_THROW(pack_rectangles({Vector2(1.0, 1.0)}, options), InvalidInput);
}

TEST(PackRectangles, huge_obstacles_are_drawn_without_overflow) {
  std::vector<Triangle> obstacles = {{Vector2(0.5, -1e30), {1e30, 1e30}, {0.5, 1e30}}};
  const Points2 corners = corners_of(obstacles);
  RoomOptions options = with_margin(0.01);
  options.obstacles = &corners;
  EXPECT_THROW(pack_rectangles({Vector2(1.0, 1.0)}, options), InvalidInput);
  obstacles = {{Vector2(0.5, -1e6), {1e6, 1e6}, {0.5, 1e6}}};
  const Points2 smaller = corners_of(obstacles);
  options.obstacles = &smaller;
  const Placement placement = pack_rectangles({Vector2(1.0, 1.0)}, options);
  EXPECT_EQ(placement.tile, 0);
  EXPECT_LT(placement.corner[0].x() + placement.scale, 0.49 + kRounding);
}

}  // namespace
}  // namespace flipfree::unwrap::pack_rectangles_test
