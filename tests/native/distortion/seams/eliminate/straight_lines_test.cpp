#include "flipfree/distortion/seams/eliminate/straight_lines.h"

#include <gtest/gtest.h>

#include "support/shapes.h"

namespace flipfree::distortion {
namespace {

CutMap flat_square(Index n) {
  CutMap map;
  map.surface = test::grid(n, n);
  map.uv = map.surface.vertices.leftCols(2);
  const auto count = static_cast<Index>(map.surface.vertices.rows());
  map.straight = straight_boundary(map, mesh::build_adjacency(count, map.surface.faces));
  return map;
}

TEST(StraightLines, ASquareHasFour) {
  const CutMap map = flat_square(3);
  EXPECT_EQ(map.straight.size(), 12U);
  const StraightLines lines = straight_lines(16, map.surface.faces, map.straight);
  ASSERT_EQ(lines.vertices.size(), 4U);
  for (const auto& line : lines.vertices) {
    for (const auto& [v, direction] : line) EXPECT_EQ(direction, line.front().second);
  }
}

}  // namespace
}  // namespace flipfree::distortion
