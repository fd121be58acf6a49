#include "flipfree/mesh/separated/rest_positions.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/validate.h"
#include "support/shapes.h"

namespace flipfree::mesh::rest_positions_test {
namespace {

Surface fan(double scale) {
  Surface s;
  s.vertices.resize(4, 3);
  s.vertices << 0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 0, 0;
  s.vertices *= scale;
  s.faces.resize(2, 3);
  s.faces << 0, 1, 2, 0, 2, 3;
  return s;
}

TEST(RestPositions, MoveOnlyCornersOfFacesWithoutArea) {
  Surface s = test::bumpy_grid(6, 6, 0.1, 1);
  EXPECT_EQ(rest_positions(s), s.vertices);
  s.vertices.row(8) = s.vertices.row(9);
  const Points3 moved = rest_positions(s);
  std::set<Index> touched;
  for (Index v = 0; v < s.vertices.rows(); ++v) {
    if (moved.row(v) != s.vertices.row(v)) touched.insert(v);
    EXPECT_LT((moved.row(v) - s.vertices.row(v)).norm(), 0.01);
  }
  EXPECT_TRUE(touched.contains(8) && touched.contains(9));
  EXPECT_LE(touched.size(), 4U);
  EXPECT_TRUE(find_defects({moved, s.faces}).empty());
}

// A face without area beside one that is a ten-millionth of its length high.
TEST(RestPositions, LeaveThinFacesTheirShape) {
  Surface s;
  s.vertices.resize(5, 3);
  s.vertices << 0, 0, 0, 1, 0, 0, 2, 0, 0, 1, -1e-7, 0, 0, -1, 0;
  s.faces.resize(3, 3);
  s.faces << 0, 1, 2, 0, 2, 3, 0, 3, 4;
  ASSERT_EQ(shapeless_faces(s.vertices, s.faces), std::vector<FaceId>{0});
  const Points3 moved = rest_positions(s);
  EXPECT_TRUE(shapeless_faces(moved, s.faces).empty());
  for (const VertexId v : {0, 2}) EXPECT_LT((moved.row(v) - s.vertices.row(v)).norm(), 1e-5) << v;
  EXPECT_EQ(moved.row(3), s.vertices.row(3));
  EXPECT_EQ(moved.row(4), s.vertices.row(4));
}

TEST(RestPositions, HoldAtAnyScaleAndPlace) {
  for (const double scale : {1e-200, 1e-12, 1.0, 1e12, 1e200}) {
    Surface s = fan(scale);
    EXPECT_TRUE(find_defects({rest_positions(s), s.faces}).empty()) << scale;
    s.vertices.setConstant(scale);
    EXPECT_TRUE(find_defects({rest_positions(s), s.faces}).empty()) << scale;
    Surface far = fan(1.0);
    far.vertices.rowwise() += Eigen::RowVector3d(1e9, -1e9, 1e9);
    EXPECT_TRUE(find_defects({rest_positions(far), far.faces}).empty());
  }
}

}  // namespace
}  // namespace flipfree::mesh::rest_positions_test
