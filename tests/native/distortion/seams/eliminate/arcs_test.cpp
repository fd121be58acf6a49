#include "flipfree/distortion/seams/eliminate/arcs.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"

namespace flipfree::distortion::arcs_test {
namespace {

// Two triangles that are neighbours across the first one's side 1-2 and the second one's 3-4.
Triangles two_faces() {
  Triangles faces(2, 3);
  faces << 0, 1, 2, 4, 3, 5;
  return faces;
}

TEST(ListArcs, EndsArePairedAcrossTheSeam) {
  const auto arcs = list_arcs(6, two_faces(), {{1, 3, 3}});
  ASSERT_EQ(arcs.size(), 2U);
  EXPECT_EQ(arcs[0].from, 1);
  EXPECT_EQ(arcs[0].to, 3);
  EXPECT_EQ(arcs[1].from, 2);
  EXPECT_EQ(arcs[1].to, 4);
  EXPECT_EQ(arcs[1].turns, 3);
}

TEST(ListArcs, RefusesWhatDoesNotExist) {
  EXPECT_THROW((void)list_arcs(6, two_faces(), {{1, 6, 0}}), InvalidInput);
  EXPECT_THROW((void)list_arcs(6, two_faces(), {{1, 1, 0}}), InvalidInput);
  EXPECT_THROW((void)list_arcs(4, two_faces(), {{1, 3, 0}}), InvalidInput);
}

}  // namespace
}  // namespace flipfree::distortion::arcs_test
