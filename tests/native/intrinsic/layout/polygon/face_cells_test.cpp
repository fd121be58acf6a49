#include "flipfree/intrinsic/layout/polygon/face_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include "flipfree/intrinsic/layout/refine/refine_map.h"
#include "intrinsic/layout/polygon/crossed_face.h"

namespace flipfree::intrinsic::face_cells_test {
namespace {

using Chords = std::vector<std::array<Index, 2>>;

// All corners and points of a face with so many points on each side.
std::vector<SidePlace> all_places(const std::array<Index, 3>& count) {
  std::vector<SidePlace> places;
  for (Index k = 0; k < 3; ++k) {
    for (Index i = 0; i <= count[static_cast<std::size_t>(k)]; ++i) places.push_back({k, i});
  }
  return places;
}

Chords sorted(Chords chords) {
  std::sort(chords.begin(), chords.end());
  return chords;
}

// Polygon: corner 0, points 1 and 2, corner 3, point 4, corner 5, point 6.
TEST(FaceCells, ChordsGoAroundCorners) {
  const std::array<Index, 3> count{2, 1, 1};
  EXPECT_EQ(sorted(face_chords(count, all_places(count))), (Chords{{1, 6}, {2, 4}}));
}

// Polygon: corner 0, point 1, corner 2, points 3 to 6, corner 7, point 8.
TEST(FaceCells, WhatIsTooMuchForTheCornersComesFromTheOneOpposite) {
  const std::array<Index, 3> count{1, 4, 1};
  EXPECT_EQ(sorted(face_chords(count, all_places(count))),
            (Chords{{0, 4}, {0, 5}, {1, 3}, {6, 8}}));
}

TEST(FaceCells, AChordWithAnEndMissingIsLeftOut) {
  const std::array<Index, 3> count{2, 1, 1};
  std::vector<SidePlace> places = all_places(count);
  places.erase(places.begin() + 1);
  EXPECT_EQ(face_chords(count, places), (Chords{{1, 3}}));
}

// Chords from the polygon's last corner to several points.
TEST(FaceCells, EveryPartBetweenChordsIsTriangulated) {
  const test::CrossedFace face = test::fan_from_last_corner(9);
  std::vector<PolygonTriangle> triangles;
  ASSERT_TRUE(triangulate_cells(face.polygon, face_chords(face.count, all_places(face.count)),
                                Storage::k64Only, triangles, ExecutionContext()));
  EXPECT_EQ(triangles.size(), face.polygon.size() - 2);
  for (const PolygonTriangle& t : triangles) {
    const auto v = [&](std::size_t k) { return face.polygon[static_cast<std::size_t>(t[k])]; };
    EXPECT_TRUE(valid_triangle(v(0), v(1), v(2), Storage::k64Only));
  }
}

// A face that winds in the plane, crossed 300 times: more than a search among diagonals is made
// for, and ears lose their way.
TEST(FaceCells, FindTrianglesWhereEarsDoNot) {
  const test::CrossedFace face = test::winding_face(300);
  std::vector<PolygonTriangle> triangles;
  ASSERT_FALSE(
      triangulate_polygon(face.polygon, {}, Storage::k64Only, triangles, ExecutionContext()));
  ASSERT_TRUE(triangulate_cells(face.polygon, face_chords(face.count, all_places(face.count)),
                                Storage::k64Only, triangles, ExecutionContext()));
  EXPECT_EQ(triangles.size(), face.polygon.size() - 2);
  const RefinedLayout layout = refine_map(face.surface, face.adjacency, face.map, Refinement::kAuto,
                                          Storage::k64Only, ExecutionContext());
  EXPECT_TRUE(layout.invalid.empty());
  EXPECT_EQ(find_broken_invariant(face.surface, layout), "");
}

}  // namespace
}  // namespace flipfree::intrinsic::face_cells_test
