#include "flipfree/unwrap/packing/nest/inflate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "unwrap/packing/nest/shapes.h"

namespace flipfree::unwrap::contacts_test {
namespace {

double narrowest(const std::vector<Contact>& contacts) {
  double least = std::numeric_limits<double>::infinity();
  for (const Contact& c : contacts) least = std::min(least, c.gap);
  return least;
}

TEST(Contacts, gaps_between_edges_and_corners_are_found_within_reach) {
  const ExecutionContext context;
  const std::vector<Shape> shapes = {test::box_shape(1, 1), test::box_shape(1, 1)};
  std::vector<Pose> poses(2);
  poses[1].centre = {1.25, 0.1};
  EXPECT_NEAR(narrowest(test::contacts(shapes, poses, 1.0, {}, 0.5)), 0.25, 1e-12);
  EXPECT_TRUE(test::contacts(shapes, poses, 1.0, {}, 0.2).empty());
  poses[1].centre = {1.3, 1.4};
  EXPECT_NEAR(narrowest(test::contacts(shapes, poses, 1.0, {}, 0.6)), 0.5, 1e-12);
}

TEST(Contacts, a_corner_inside_has_a_negative_gap_and_is_pushed_out) {
  const ExecutionContext context;
  const std::vector<Shape> shapes = {test::box_shape(1, 1), test::box_shape(1, 1)};
  std::vector<Pose> poses(2);
  poses[1].centre = {0.95, 0.3};
  const auto contacts = test::contacts(shapes, poses, 1.0, {}, 0.2);
  EXPECT_NEAR(narrowest(contacts), -0.05, 1e-12);
  EXPECT_TRUE(any_crossing(shapes, poses, 1.0, {}, context));
  poses[1].centre = {1.05, 0.3};
  EXPECT_FALSE(any_crossing(shapes, poses, 1.0, {}, context));
}

TEST(Contacts, what_is_remembered_changes_nothing) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Shape> shapes;
  std::vector<Pose> poses;
  for (int i = 0; i < 36; ++i) {
    shapes.push_back(i % 5 == 0 ? test::frame(0.1) : test::box_shape(0.1, 0.05 + 0.002 * i));
    poses.push_back({Vector2(0.12 * (i % 6), 0.12 * (i / 6)), Vector2(1.0, 0.0)});
  }
  const std::vector<Loop> fixed = {test::box(0.02, 0.9)};
  Contacts remembering(shapes, fixed);
  double scale = 1.0;
  for (int step = 0; step < 60; ++step) {
    const double reach = 0.03 + 0.01 * unit(random);
    for (Pose& pose : poses) {
      pose.centre += 0.002 * Vector2(unit(random), unit(random));
      const double angle = 0.02 * unit(random);
      const Vector2 t = pose.turn;
      pose.turn = Vector2(t.x() - angle * t.y(), t.y() + angle * t.x()).normalized();
    }
    scale *= 1.0 + 0.002 * unit(random);
    const auto found = remembering.find(poses, scale, reach, ExecutionContext());
    const auto anew = test::contacts(shapes, poses, scale, fixed, reach);
    ASSERT_EQ(found.size(), anew.size()) << step;
    ASSERT_FALSE(anew.empty());
    for (std::size_t i = 0; i < anew.size(); ++i) {
      EXPECT_EQ(found[i].a, anew[i].a);
      EXPECT_EQ(found[i].b, anew[i].b);
      EXPECT_EQ(found[i].gap, anew[i].gap);
      EXPECT_EQ(found[i].point, anew[i].point);
    }
  }
}

TEST(Contacts, what_is_fixed_counts_and_holes_are_empty) {
  const ExecutionContext context;
  const std::vector<Shape> shapes = {test::frame(2.0), test::box_shape(1, 1)};
  std::vector<Pose> poses(2);
  EXPECT_NEAR(narrowest(test::contacts(shapes, poses, 1.0, {}, 1.0)), 0.3, 1e-12);
  EXPECT_FALSE(any_crossing(shapes, poses, 1.0, {}, context));
  Loop wall = test::box(1, 1);
  for (Vector2& p : wall) p += Vector2(1.2, -0.5);
  EXPECT_NEAR(narrowest(test::contacts(shapes, poses, 1.0, {wall}, 0.25)), 0.2, 1e-12);
}

}  // namespace
}  // namespace flipfree::unwrap::contacts_test
