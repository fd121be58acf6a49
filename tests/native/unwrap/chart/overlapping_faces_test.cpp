#include "flipfree/unwrap/chart/separate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "fuzz/rational.h"
#include "support/shapes.h"
#include "unwrap/chart/bent_strip.h"

namespace flipfree::unwrap::overlapping_faces_test {
namespace {

// Positive triangles on a coarse lattice, where much touches: all pairs by clipping in rational
// numbers, their areas by formula where one lies in the other.
TEST(OverlappingFaces, are_all_pairs_whose_interiors_meet) {
  std::mt19937 random(1);
  std::size_t total = 0;
  for (int round = 0; round < 100; ++round) {
    const Index count = 2 + static_cast<Index>(random() % 20);
    Triangles faces(count, 3);
    Points2 uv(3 * count, 2);
    std::vector<fuzz::Corners> corners(static_cast<std::size_t>(count));
    for (Index f = 0; f < count; ++f) {
      faces.row(f) << 3 * f, 3 * f + 1, 3 * f + 2;
      int turn = 0;
      while (turn == 0) {
        const Vector2 place(random() % 9, random() % 9);
        for (Index k = 0; k < 3; ++k) {
          uv.row(3 * f + k) = place + Vector2(random() % 4, random() % 4);
          if (random() % 4 == 0) uv(3 * f + k, 1) = std::nextafter(uv(3 * f + k, 1), 99.0);
        }
        const auto at = [&](Index k) { return fuzz::exact(uv.row(3 * f + k).transpose()); };
        turn = fuzz::side(at(0), at(1), at(2));
      }
      if (turn < 0) uv.row(3 * f + 1).swap(uv.row(3 * f + 2));
      for (Index k = 0; k < 3; ++k)
        corners[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)] =
            fuzz::exact(uv.row(3 * f + k).transpose());
    }
    const std::vector<FacePair> found = overlapping_faces(faces, uv, ExecutionContext());
    std::size_t next = 0;
    for (FaceId f = 0; f < count; ++f) {
      for (FaceId g = f + 1; g < count; ++g) {
        if (!fuzz::share_area(corners[static_cast<std::size_t>(f)],
                              corners[static_cast<std::size_t>(g)]))
          continue;
        ASSERT_LT(next, found.size());
        EXPECT_EQ(found[next].first, f);
        EXPECT_EQ(found[next].second, g);
        EXPECT_GT(found[next].area, 0.0);
        ++next;
      }
    }
    EXPECT_EQ(next, found.size());
    total += next;
  }
  EXPECT_GT(total, 500U);
}

TEST(OverlappingFaces, neighbours_of_a_flat_map_share_nothing) {
  const mesh::Surface grid = test::grid(12, 9);
  EXPECT_TRUE(
      overlapping_faces(grid.faces, grid.vertices.leftCols<2>(), ExecutionContext()).empty());
}

TEST(OverlappingFaces, are_found_with_the_area_they_share) {
  const mesh::Surface strip = test::grid(60, 2);
  ExecutionContext context;
  EXPECT_TRUE(overlapping_faces(strip.faces, test::bent(strip, 0.9), context).empty());
  const Points2 uv = test::bent(strip, 1.5);
  double shared = 0;
  for (const FacePair& pair : overlapping_faces(strip.faces, uv, context)) {
    EXPECT_LT(pair.first, pair.second);
    shared += pair.area;
  }
  // Half a turn of the ring between the radii 0.9 and 1.1, by polygons of 40 sides a turn.
  const double ring = std::numbers::pi * (1.1 * 1.1 - 0.9 * 0.9);
  EXPECT_NEAR(shared, 0.5 * ring, 0.01 * ring);
}

// The square of 1e-170 is no double.
TEST(OverlappingFaces, share_an_area_even_if_no_double_holds_it) {
  Triangles faces(2, 3);
  faces << 0, 1, 2, 3, 4, 5;
  Points2 uv(6, 2);
  uv << 0, 0, 2, 0, 0, 2, 1, 0, 3, 0, 1, 2;
  ExecutionContext context;
  const std::vector<FacePair> pairs = overlapping_faces(faces, 1e-170 * uv, context);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_GE(pairs[0].area, std::numeric_limits<double>::min());
}

}  // namespace
}  // namespace flipfree::unwrap::overlapping_faces_test
