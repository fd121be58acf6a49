#include "flipfree/base/failure.h"

#include <gtest/gtest.h>

#include <vector>

namespace flipfree::elements_test {
namespace {

TEST(Elements, FacesOfAnErrorAreThoseThatItNamesOrThoseAtItsVertices) {
  Triangles faces(3, 3);
  faces << 0, 1, 2, 2, 1, 3, 3, 4, 5;
  Error error;
  error.elements = {2, 5};
  error.kind = ElementKind::kFace;
  EXPECT_EQ(faces_at(error, faces), (std::vector<FaceId>{2, 5}));
  error.kind = ElementKind::kVertex;
  EXPECT_EQ(faces_at(error, faces), (std::vector<FaceId>{0, 1, 2}));
  error.elements = {0};
  EXPECT_EQ(faces_at(error, faces), std::vector<FaceId>{0});
  error.kind = ElementKind::kEdge;
  EXPECT_TRUE(faces_at(error, faces).empty());
}

TEST(Elements, AreAThousandAtMost) {
  EXPECT_EQ(first_elements(std::vector<Index>(5000, 7)).size(), kMostElements);
  EXPECT_EQ(first_elements({1, 2}), (std::vector<Index>{1, 2}));
}

}  // namespace
}  // namespace flipfree::elements_test
