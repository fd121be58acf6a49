#include "flipfree/unwrap/islands/islands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/shapes.h"

namespace flipfree::unwrap::hills_test {
namespace {

// A 12 x 4 grid, vertex (column, row) = 13 row + column, with a field that is zero on its border.
struct Field {
  mesh::Surface surface = test::grid(12, 4);
  std::vector<double> u = std::vector<double>(65, 0.0);
  std::vector<double> area = std::vector<double>(65, 1.0);
  std::vector<char> reach = std::vector<char>(65, 1);

  std::vector<Hill> found() const {
    std::vector<Hill> hills = unwrap::hills(surface, u, area, reach);
    std::sort(hills.begin(), hills.end(),
              [](const Hill& a, const Hill& b) { return a.peak < b.peak; });
    return hills;
  }
};

TEST(Hills, the_lower_of_two_gains_what_stands_out_of_the_pass_and_the_higher_all) {
  Field field;
  for (const auto& [column, height] : {std::pair{3, 1.0}, {4, 3.0}, {5, 1.0}, {6, 2.0}, {7, 1.0}})
    field.u[static_cast<std::size_t>(2 * 13 + column)] = height;
  const std::vector<Hill> hills = field.found();
  ASSERT_EQ(hills.size(), 2U);
  EXPECT_EQ(hills[0].peak, 2 * 13 + 4);
  EXPECT_DOUBLE_EQ(hills[0].gain, 9.0 + 4.0 + 3.0);
  EXPECT_EQ(hills[1].peak, 2 * 13 + 6);
  EXPECT_DOUBLE_EQ(hills[1].gain, 1.0);
}

TEST(Hills, growth_and_shrinking_are_told_apart) {
  Field field;
  field.u[2 * 13 + 4] = 2.0;
  field.u[2 * 13 + 5] = -1.0;
  const std::vector<Hill> hills = field.found();
  ASSERT_EQ(hills.size(), 2U);
  EXPECT_DOUBLE_EQ(hills[0].gain, 4.0);
  EXPECT_DOUBLE_EQ(hills[1].gain, 1.0);
}

TEST(Hills, end_where_a_seam_may_end) {
  Field field;
  field.u[2 * 13 + 4] = 2.0;
  field.u[2 * 13 + 5] = 1.0;
  field.reach[2 * 13 + 4] = 0;
  ASSERT_EQ(field.found().size(), 1U);
  EXPECT_EQ(field.found()[0].peak, 2 * 13 + 5);
  field.reach[2 * 13 + 5] = 0;
  EXPECT_TRUE(field.found().empty());
}

}  // namespace
}  // namespace flipfree::unwrap::hills_test
