#include "flipfree/mesh/face_area.h"

#include <gtest/gtest.h>

#include <vector>

namespace flipfree::mesh::face_area_test {
namespace {

bool area_of(double x, double y, double scale) {
  Points3 p(3, 3);
  p << 0, 0, 0, 1, 1, 1, x, y, x;
  p *= scale;
  Triangles f(1, 3);
  f << 0, 1, 2;
  return has_area(p, f, 0);
}

TEST(FaceArea, IsDecidedExactlyAtAnyScale) {
  for (const double scale : {1e-150, 1e-5, 1.0, 1e150}) {
    EXPECT_FALSE(area_of(0.5, 0.5, scale));
    EXPECT_FALSE(area_of(1.0, 1.0, scale));
    EXPECT_FALSE(area_of(0.0, 0.0, scale));
    EXPECT_TRUE(area_of(0.5, 0.6, scale));
  }
  EXPECT_TRUE(area_of(0.5, 0.5 + 0x1p-53, 1.0));
}

// Three of six faces are thin, and hardly any of the surface; squeezed flat, all are.
TEST(FaceArea, ThinFacesHaveNoShapeWhereTheyAreFewOrLittleOfTheSurface) {
  for (const double scale : {1e-200, 1.0, 1e200}) {
    Points3 p(7, 3);
    p << 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0, 0, 0.5, 1e-9, 0, 0.5, 2e-9, 0, 0.5, 3e-9, 0;
    Triangles f(6, 3);
    f << 0, 1, 2, 0, 2, 3, 1, 3, 2, 0, 1, 4, 0, 1, 5, 0, 1, 6;
    p *= scale;
    EXPECT_EQ(shapeless_faces(p, f), (std::vector<FaceId>{3, 4, 5}));
    p.col(1) *= 1e-9;
    EXPECT_TRUE(shapeless_faces(p, f).empty());
  }
}

}  // namespace
}  // namespace flipfree::mesh::face_area_test
