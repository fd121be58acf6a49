#include "flipfree/mesh/separated/polygons.h"

#include <gtest/gtest.h>

#include <vector>

#include "support/shapes.h"

namespace flipfree::mesh::polygons_test {
namespace {

// Two quads side by side, 0 1 4 3 and 1 2 5 4, whose diagonals are 0 4 and 1 5.
Triangles two_quads() {
  Triangles faces(4, 3);
  faces << 0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4;
  return faces;
}
IndexPairs diagonals() {
  IndexPairs pairs(2, 2);
  pairs << 4, 0, 1, 5;
  return pairs;
}

TEST(Polygons, AreTrianglesThatMeetAtDiagonals) {
  const std::vector<Index> found = polygons_of(two_quads(), 6, diagonals());
  EXPECT_EQ(found[0], found[1]);
  EXPECT_EQ(found[2], found[3]);
  EXPECT_NE(found[0], found[2]);
}

TEST(Polygons, AreNotGuessedWhereMoreThanTwoTrianglesMeetAtADiagonal) {
  Triangles faces(5, 3);
  faces << two_quads(), 0, 4, 6;
  const std::vector<Index> found = polygons_of(faces, 7, diagonals());
  EXPECT_NE(found[0], found[1]);
  EXPECT_EQ(found[2], found[3]);
}

TEST(Polygons, ThatAMapIsCutThroughAreNamedByTheirSides) {
  Points2f uv(12, 2);
  uv << 0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1, 1, 0, 2, 0, 2, 1, 1, 0, 2, 1, 1, 1;
  EXPECT_EQ(sides_of_torn_polygons(two_quads(), {8, 8, 2, 2}, uv).rows(), 0);
  uv.bottomRows(3).array() += 3.0F;  // triangle 1 5 4 is elsewhere
  IndexPairs sides(4, 2);
  sides << 1, 2, 1, 4, 2, 5, 4, 5;
  EXPECT_EQ(sides_of_torn_polygons(two_quads(), {8, 8, 2, 2}, uv), sides);
  EXPECT_EQ(sides_of_torn_polygons(two_quads(), {8, 8, 2, 3}, uv).rows(), 0);
}

}  // namespace
}  // namespace flipfree::mesh::polygons_test
