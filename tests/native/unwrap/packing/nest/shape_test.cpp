#include "flipfree/unwrap/packing/nest/shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "unwrap/packing/nest/shapes.h"

namespace flipfree::unwrap::shape_test {
namespace {

TEST(Shape, corners_that_stand_out_by_less_than_the_tolerance_are_dropped) {
  const Loop loop = {{0, 0}, {1, 0.001}, {2, 0}, {2, 2}, {1, 2.1}, {0, 2}};
  EXPECT_EQ(simplified(loop, 0.01).size(), 5u);
  EXPECT_EQ(simplified(loop, 0.0).size(), 6u);
  EXPECT_GE(simplified(loop, 10.0).size(), 3u);
}

TEST(Shape, points_stay_points) {
  const Loop point(5, Vector2(1.0, 1.0));
  EXPECT_EQ(simplified(point, 0.1).size(), 1u);
}

TEST(Shape, the_middle_goes_to_the_origin_and_holes_count_in_the_area) {
  Vector2 middle;
  Loop outside = test::box(4.0, 2.0);
  const Shape shape = make_shape({outside}, 0.0, middle);
  EXPECT_EQ(middle, Vector2(2.0, 1.0));
  EXPECT_DOUBLE_EQ(shape.area, 8.0);
  EXPECT_DOUBLE_EQ(shape.radius, std::sqrt(5.0));
  EXPECT_NEAR(test::frame(1.0).area, 0.36, 1e-12);
}

TEST(Shape, straight_ones_have_many_sides_in_two_directions_at_a_right_angle) {
  const auto turned = [](Loop loop, double angle) {
    for (Vector2& p : loop) p = Pose{{}, {std::cos(angle), std::sin(angle)}}(p, 1.0);
    return loop;
  };
  Loop letter = {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 2}, {2, 2}, {2, 3}, {0, 3}};
  Loop circle;
  for (int i = 0; i < 40; ++i)
    circle.emplace_back(std::cos(std::numbers::pi * i / 20), std::sin(std::numbers::pi * i / 20));
  // Four of its ten directions run along one cross.
  const Loop plate = {{0, 0},     {4, 0},     {4, 1},     {3.5, 1.9},
                      {2.6, 2.6}, {1.6, 2.9}, {0.7, 2.7}, {0, 2}};
  for (const double angle : {0.0, 0.3, 0.7, -0.7, 2.0}) {
    for (const Loop& straight : {letter, test::box(4.0, 1.0), plate}) {
      const Vector2 axis = straight_axis({turned(straight, angle)});
      ASSERT_GT(axis.x(), 0.0);
      const double left =
          std::remainder(angle + std::atan2(axis.y(), axis.x()), 0.5 * std::numbers::pi);
      EXPECT_NEAR(left, 0.0, 1e-12);
    }
    EXPECT_EQ(straight_axis({turned(circle, angle)}), Vector2(0, 0));
  }
  EXPECT_TRUE(is_straight(test::box_shape(2.0, 1.0)));
  Vector2 middle;
  EXPECT_FALSE(is_straight(make_shape({turned(letter, 0.3)}, 0.0, middle)));
  EXPECT_EQ(straight_axis({Loop(3, Vector2(1.0, 1.0))}), Vector2(0, 0));
}

TEST(Shape, the_square_around_it_is_smallest_after_its_squarest_turn) {
  const auto side = [](const Shape& shape, const Vector2& turn) {
    Vector2 low = Vector2::Constant(1e9), high = Vector2::Constant(-1e9);
    for (const Vector2& p : shape.loops.front()) {
      low = low.cwiseMin(Pose{Vector2::Zero(), turn}(p, 1.0));
      high = high.cwiseMax(Pose{Vector2::Zero(), turn}(p, 1.0));
    }
    return (high - low).maxCoeff();
  };
  // A rectangle lies on the diagonal, a square on its sides.
  const Shape rectangle = test::box_shape(4.0, 1.0);
  EXPECT_NEAR(side(rectangle, squarest_turn(rectangle)), 5.0 / std::sqrt(2.0), 1e-2);
  for (const double angle : {0.0, 0.1, 0.4, 0.77, 1.5}) {
    Loop square = test::box(1.0, 1.0);
    for (Vector2& p : square) p = Pose{{}, {std::cos(angle), std::sin(angle)}}(p, 1.0);
    Vector2 middle;
    const Shape shape = make_shape({square}, 0.0, middle);
    EXPECT_NEAR(side(shape, squarest_turn(shape)), 1.0, 1e-2) << angle;
  }
}

TEST(Shape, a_pose_turns_scales_and_moves) {
  const Pose pose{Vector2(1.0, 2.0), Vector2(0.0, 1.0)};
  EXPECT_EQ(pose(Vector2(3.0, 0.0), 2.0), Vector2(1.0, 8.0));
}

}  // namespace
}  // namespace flipfree::unwrap::shape_test
