#include "flipfree/unwrap/packing/nest/contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "unwrap/packing/nest/shapes.h"

namespace flipfree::unwrap {
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
  EXPECT_NEAR(narrowest(find_contacts(shapes, poses, 1.0, {}, 0.5, context)), 0.25, 1e-12);
  EXPECT_TRUE(find_contacts(shapes, poses, 1.0, {}, 0.2, context).empty());
  poses[1].centre = {1.3, 1.4};
  EXPECT_NEAR(narrowest(find_contacts(shapes, poses, 1.0, {}, 0.6, context)), 0.5, 1e-12);
}

TEST(Contacts, a_corner_inside_has_a_negative_gap_and_is_pushed_out) {
  const ExecutionContext context;
  const std::vector<Shape> shapes = {test::box_shape(1, 1), test::box_shape(1, 1)};
  std::vector<Pose> poses(2);
  poses[1].centre = {0.95, 0.3};
  const auto contacts = find_contacts(shapes, poses, 1.0, {}, 0.2, context);
  EXPECT_NEAR(narrowest(contacts), -0.05, 1e-12);
  EXPECT_TRUE(any_crossing(shapes, poses, 1.0, {}, context));
  poses[1].centre = {1.05, 0.3};
  EXPECT_FALSE(any_crossing(shapes, poses, 1.0, {}, context));
}

TEST(Contacts, what_is_fixed_counts_and_holes_are_empty) {
  const ExecutionContext context;
  const std::vector<Shape> shapes = {test::frame(2.0), test::box_shape(1, 1)};
  std::vector<Pose> poses(2);
  EXPECT_NEAR(narrowest(find_contacts(shapes, poses, 1.0, {}, 1.0, context)), 0.3, 1e-12);
  EXPECT_FALSE(any_crossing(shapes, poses, 1.0, {}, context));
  Loop wall = test::box(1, 1);
  for (Vector2& p : wall) p += Vector2(1.2, -0.5);
  EXPECT_NEAR(narrowest(find_contacts(shapes, poses, 1.0, {wall}, 0.25, context)), 0.2, 1e-12);
}

}  // namespace
}  // namespace flipfree::unwrap
