#include "flipfree/mesh/islands.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "flipfree/base/error.h"

namespace flipfree::mesh::islands_test {
namespace {

// Two triangles at the edge (0, 1).
Triangles pair_of_faces() {
  Triangles faces(2, 3);
  faces << 0, 1, 2, 1, 0, 3;
  return faces;
}

Points2f uv_of(const Triangles& faces) {
  Points2f uv(faces.size(), 2);
  for (Index c = 0; c < static_cast<Index>(faces.size()); ++c) {
    const auto v = static_cast<float>(faces.data()[c]);
    uv.row(c) << v, v * v;
  }
  return uv;
}

using Faces = std::vector<FaceId>;

TEST(Islands, CountsEdgesWhoseSidesDifferInTheLastBitsOnly) {
  const Triangles faces = pair_of_faces();
  Points2f uv = uv_of(faces);
  uv(1, 1) = std::nextafter(uv(1, 1), 2.0F);
  const Islands found = islands_of(faces, &uv);
  EXPECT_EQ(found.first, (Faces{0, 1}));
  EXPECT_EQ(found.nearly_joined, 1);
}

TEST(Islands, ZeroHasNoSignAndWhatIsNoNumberJoinsNothing) {
  const Triangles faces = pair_of_faces();
  Points2f uv = uv_of(faces);
  uv(0, 0) = -0.0F;
  EXPECT_EQ(islands_of(faces, &uv).first, (Faces{0, 0}));
  uv(0, 0) = uv(4, 0) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(islands_of(faces, &uv).first, (Faces{0, 1}));
  EXPECT_EQ(islands_of(faces, &uv).nearly_joined, 0);
}

TEST(Islands, OfManyFacesAtAnEdgeThoseOfOnePlaceBelongTogetherWhateverLiesBetween) {
  constexpr Index kCount = 20000;  // not all pairs of them
  Triangles faces(kCount, 3);
  Points2f uv(3 * kCount, 2);
  for (Index f = 0; f < kCount; ++f) {
    faces.row(f) << 0, 1, f + 2;
    const auto place = static_cast<float>(f % 3);
    uv.row(3 * f) << place, 0.0F;
    uv.row(3 * f + 1) << place, 1.0F;
    uv.row(3 * f + 2) << static_cast<float>(f), 9.0F;
  }
  const Islands found = islands_of(faces, &uv);
  for (Index f = 0; f < kCount; ++f) EXPECT_EQ(found.first[static_cast<std::size_t>(f)], f % 3);
}

TEST(Islands, IdsMayLeaveOutNumbersAndNegativeOnesAreRefused) {
  Triangles faces = pair_of_faces();
  faces(1, 2) = std::numeric_limits<Index>::max();
  EXPECT_EQ(islands_of(faces, nullptr).first, (Faces{0, 0}));
  faces(1, 2) = -1;
  EXPECT_THROW(islands_of(faces, nullptr), InvalidInput);
  EXPECT_TRUE(islands_of(Triangles(0, 3), nullptr).first.empty());
}

}  // namespace
}  // namespace flipfree::mesh::islands_test
