#include "flipfree/mesh/islands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
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

// As the contract says it, and as slowly.
Faces slow_labels(const Triangles& faces, const Points2f& uv) {
  const auto count = static_cast<Index>(faces.rows());
  Faces label(static_cast<std::size_t>(count));
  for (Index f = 0; f < count; ++f) label[static_cast<std::size_t>(f)] = f;
  const auto corner = [&](Index f, VertexId v) {
    for (Index k = 0; k < 3; ++k)
      if (faces(f, k) == v) return 3 * f + k;
    return kInvalid;
  };
  const auto joined = [&](Index f, Index g) {
    for (Index k = 0; k < 3; ++k) {
      const VertexId a = faces(f, k), b = faces(f, (k + 1) % 3);
      const Index c = corner(g, a), d = corner(g, b);
      if (c == kInvalid || d == kInvalid) continue;
      if (uv.row(corner(f, a)) == uv.row(c) && uv.row(corner(f, b)) == uv.row(d)) return true;
    }
    return false;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (Index f = 0; f < count; ++f) {
      for (Index g = 0; g < f; ++g) {
        FaceId& a = label[static_cast<std::size_t>(f)];
        FaceId& b = label[static_cast<std::size_t>(g)];
        if (a == b || !joined(f, g)) continue;
        a = b = std::min(a, b);
        changed = true;
      }
    }
  }
  return label;
}

TEST(Islands, AgreeWithSlowCodeOnRandomFaces) {
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    const Index count = std::uniform_int_distribution<Index>(1, 14)(random);
    std::uniform_int_distribution<Index> vertex(0, 6);
    std::uniform_int_distribution<int> place(0, 1);
    Triangles faces(count, 3);
    Points2f uv(3 * count, 2);
    for (Index f = 0; f < count; ++f) {
      do {
        faces.row(f) << vertex(random), vertex(random), vertex(random);
      } while (faces(f, 0) == faces(f, 1) || faces(f, 1) == faces(f, 2) ||
               faces(f, 2) == faces(f, 0));
      for (Index k = 0; k < 3; ++k)
        uv.row(3 * f + k) << static_cast<float>(faces(f, k)), static_cast<float>(place(random));
    }
    EXPECT_EQ(islands_of(faces, &uv).first, slow_labels(faces, uv)) << "round " << round;
  }
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
