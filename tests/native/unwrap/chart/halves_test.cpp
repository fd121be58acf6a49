#include "flipfree/unwrap/chart/separate.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/mesh/topology.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::halves_test {
namespace {

Points2 flat(const mesh::Surface& surface) { return surface.vertices.leftCols<2>(); }

TEST(Halves, a_long_sheet_is_cut_across) {
  mesh::Surface sheet = test::grid(24, 6);
  sheet.vertices.col(0) *= 4.0;
  mesh::Adjacency adjacency = test::adjacency_of(sheet);
  ExecutionContext context;
  const mesh::EdgeFlags cut = halving_cut(sheet, adjacency, flat(sheet), {}, false, context);
  EXPECT_EQ(std::count(cut.begin(), cut.end(), 1), 2 * 6);
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0) adjacency.opposite[h] = kInvalid;
  }
  const mesh::Components parts = mesh::face_components(adjacency);
  ASSERT_EQ(parts.count, 2);
  const auto first = std::count(parts.of_face.begin(), parts.of_face.end(), 0);
  EXPECT_GE(first, sheet.faces.rows() / 4);
  EXPECT_LE(first, sheet.faces.rows() - sheet.faces.rows() / 4);
}

TEST(Halves, polygons_stay_whole) {
  const mesh::Surface square = test::grid(1, 1);
  const mesh::Adjacency adjacency = test::adjacency_of(square);
  mesh::EdgeFlags diagonal(adjacency.opposite.size(), 0);
  for (std::size_t h = 0; h < diagonal.size(); ++h)
    diagonal[h] = adjacency.opposite[h] == kInvalid ? 0 : 1;
  ExecutionContext context;
  const mesh::EdgeFlags cut =
      halving_cut(square, adjacency, flat(square), diagonal, false, context);
  EXPECT_EQ(std::count(cut.begin(), cut.end(), 1), 0);
  const mesh::EdgeFlags free = halving_cut(square, adjacency, flat(square), {}, false, context);
  EXPECT_EQ(std::count(free.begin(), free.end(), 1), 2);
}

// Two triangles above a line, one below it, and one of no area on it.
TEST(Halves, what_has_no_area_stays_with_a_neighbour) {
  mesh::Surface surface;
  surface.vertices.resize(5, 3);
  surface.vertices << 0, 0, 0, 2, 0, 0, 1, 0, 0, 1, -4, 0, 1, 4, 0;
  surface.faces.resize(4, 3);
  surface.faces << 0, 3, 1, 0, 1, 2, 0, 2, 4, 2, 1, 4;
  const mesh::Adjacency adjacency = test::adjacency_of(surface);
  ExecutionContext context;
  const mesh::EdgeFlags cut = halving_cut(surface, adjacency, flat(surface), {}, false, context);
  EXPECT_EQ(std::count(cut.begin(), cut.end(), 1), 4);
  EXPECT_EQ(cut[2], 0) << "of the triangle below and that on the line";
}

TEST(Halves, two_of_a_fan_that_is_one_polygon_but_for_a_triangle_are_parted_there) {
  const mesh::Surface strip = test::grid(3, 1);
  const mesh::Adjacency adjacency = test::adjacency_of(strip);
  const FaceId alone = 0;
  mesh::EdgeFlags whole(adjacency.opposite.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(whole.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    whole[static_cast<std::size_t>(h)] = o == kInvalid || h / 3 == alone || o / 3 == alone ? 0 : 1;
  }
  ExecutionContext context;
  const mesh::EdgeFlags cut = halving_cut(strip, adjacency, flat(strip), whole, false, context);
  EXPECT_GT(std::count(cut.begin(), cut.end(), 1), 0);
  for (std::size_t h = 0; h < cut.size(); ++h) EXPECT_FALSE(cut[h] != 0 && whole[h] != 0) << h;
}

}  // namespace
}  // namespace flipfree::unwrap::halves_test
