#include "flipfree/unwrap/packing/boxes/free_boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace flipfree::unwrap::free_boxes_test {
namespace {

Points2 random_triangles(Eigen::Index count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-0.2, 1.2);
  std::uniform_real_distribution<double> offset(-0.15, 0.15);
  Points2 corners(3 * count, 2);
  for (Eigen::Index t = 0; t < count; ++t) {
    const Eigen::RowVector2d centre(place(random), place(random));
    for (Eigen::Index k = 0; k < 3; ++k)
      corners.row(3 * t + k) = centre + Eigen::RowVector2d(offset(random), offset(random));
  }
  return corners;
}

bool inside(const FreeBox& box, const Vector2& p) {
  return (p.array() >= box.low.array()).all() && (p.array() <= (box.low + box.size).array()).all();
}

TEST(FreeBoxes, the_empty_square_is_one_box_less_the_margin) {
  const std::vector<FreeBox> boxes = free_boxes(Points2(0, 2), Vector2::Zero(), 0.01);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_EQ(boxes[0].low, Vector2::Zero());
  EXPECT_EQ(boxes[0].size, Vector2::Constant(0.99));
}

TEST(FreeBoxes, are_disjoint_inside_the_square_and_clear_of_all_points_of_obstacles) {
  constexpr double kMargin = 0.006;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Points2 corners = random_triangles(1 + seed, seed);
    const std::vector<FreeBox> boxes = free_boxes(corners, Vector2::Zero(), kMargin);
    ASSERT_FALSE(boxes.empty());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      EXPECT_GE(boxes[i].low.minCoeff(), 0.0);
      EXPECT_LE((boxes[i].low + boxes[i].size).maxCoeff(), 1.0 - kMargin);
      for (std::size_t j = 0; j < i; ++j) {
        const Vector2 apart = (boxes[i].low - boxes[j].low - boxes[j].size)
                                  .cwiseMax(boxes[j].low - boxes[i].low - boxes[i].size);
        EXPECT_GE(apart.maxCoeff(), 0.0);
      }
    }
    for (int sample = 0; sample < 3000; ++sample) {
      const Eigen::Index t = 3 * (sample % (corners.rows() / 3));
      double a = unit(random);
      double b = unit(random);
      if (a + b > 1.0) a = 1.0 - a, b = 1.0 - b;
      Vector2 p = ((1.0 - a - b) * corners.row(t) + a * corners.row(t + 1) + b * corners.row(t + 2))
                      .transpose();
      // Nothing may lie within the margin to the left of a point and below it either.
      p -= kMargin * Vector2(unit(random), unit(random));
      for (const FreeBox& box : boxes) EXPECT_FALSE(inside(box, p));
    }
  }
}

TEST(FreeBoxes, most_of_the_room_is_found) {
  Points2 corners(6, 2);  // the left half
  corners << 0.0, 0.0, 0.5, 0.0, 0.5, 1.0, 0.0, 0.0, 0.5, 1.0, 0.0, 1.0;
  const std::vector<FreeBox> boxes = free_boxes(corners, Vector2::Zero(), 0.0);
  double area = 0.0;
  for (const FreeBox& box : boxes) area += box.size.prod();
  EXPECT_GT(area, 0.49);
}

TEST(FreeBoxes, obstacles_count_in_their_own_tile) {
  Points2 corners(3, 2);
  corners << 2.0, 0.0, 3.0, 0.0, 2.0, 1.0;
  const auto area = [&](double column) {
    double sum = 0.0;
    for (const FreeBox& box : free_boxes(corners, Vector2(column, 0.0), 0.0))
      sum += box.size.prod();
    return sum;
  };
  EXPECT_EQ(area(0.0), 1.0);
  EXPECT_LT(area(2.0), 0.5);
  EXPECT_GT(area(2.0), 0.4);
}

}  // namespace
}  // namespace flipfree::unwrap::free_boxes_test
