#include "flipfree/mesh/face_area.h"

#include <gtest/gtest.h>

namespace flipfree::mesh {
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

}  // namespace
}  // namespace flipfree::mesh
