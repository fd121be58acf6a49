#include "flipfree/distortion/seams/eliminate/straight_lines.h"

#include <gtest/gtest.h>

#include "distortion/seams/flat_square.h"

namespace flipfree::distortion::straight_lines_test {
namespace {

TEST(StraightLines, ASquareHasFour) {
  const CutMap map = test::flat_square(3);
  EXPECT_EQ(map.straight.size(), 12U);
  const StraightLines lines = straight_lines(16, map.surface.faces, map.straight);
  ASSERT_EQ(lines.vertices.size(), 4U);
  for (const auto& line : lines.vertices) {
    for (const auto& [v, direction] : line) EXPECT_EQ(direction, line.front().second);
  }
}

}  // namespace
}  // namespace flipfree::distortion::straight_lines_test
