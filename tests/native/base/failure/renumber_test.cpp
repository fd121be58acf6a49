#include "flipfree/base/failure.h"

#include <gtest/gtest.h>

namespace flipfree::renumber_test {
namespace {

Renumbering shifted() {
  return {[](Index v) { return v > 90 ? kInvalid : v + 100; }, [](Index f) { return f + 1000; },
          [](Index c) { return 2 * c; }};
}

TEST(Renumber, NamesElementsAnewAndLeavesCountsAlone) {
  EXPECT_EQ(
      renumbered("Chart of face 0 (12 triangles, first at vertex 7): 3 faces fold.", shifted()),
      "Chart of face 1000 (12 triangles, first at vertex 107): 3 faces fold.");
  EXPECT_EQ(renumbered("Corner 21 is pinned to 0.5, corner 4 is not.", shifted()),
            "Corner 42 is pinned to 0.5, corner 8 is not.");
}

TEST(Renumber, KnowsPairsOfVertices) {
  EXPECT_EQ(renumbered("first edge 3-5; vertices 1 and 2. Edge 8-9", shifted()),
            "first edge 103-105; vertices 101 and 102. Edge 108-109");
  EXPECT_EQ(renumbered("first face 3 and 4 more", shifted()), "first face 1003 and 4 more");
}

TEST(Renumber, LeavesWhatIsNoId) {
  EXPECT_EQ(renumbered("", shifted()), "");
  EXPECT_EQ(renumbered("vertex 99 and surface 3, 41 vertices", shifted()),
            "vertex 99 and surface 3, 41 vertices");
  EXPECT_EQ(renumbered("vertex 99999999999", shifted()), "vertex 99999999999");
}

}  // namespace
}  // namespace flipfree::renumber_test
