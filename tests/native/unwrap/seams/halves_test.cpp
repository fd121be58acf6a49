#include "flipfree/unwrap/seams/halves.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/mesh/topology.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap {
namespace {

Points2 flat(const mesh::Surface& surface) {
  Points2 corners(surface.faces.size(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c)
    corners.row(c) = surface.vertices.row(surface.faces.data()[c]).head<2>();
  return corners;
}

TEST(Halves, a_long_sheet_is_cut_across) {
  mesh::Surface sheet = test::grid(24, 6);
  sheet.vertices.col(0) *= 4.0;
  mesh::Adjacency adjacency = test::adjacency_of(sheet);
  ExecutionContext context;
  const mesh::EdgeFlags cut = halving_cut(sheet, adjacency, flat(sheet), {}, context);
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
  const mesh::EdgeFlags cut = halving_cut(square, adjacency, flat(square), diagonal, context);
  EXPECT_EQ(std::count(cut.begin(), cut.end(), 1), 0);
  const mesh::EdgeFlags free = halving_cut(square, adjacency, flat(square), {}, context);
  EXPECT_EQ(std::count(free.begin(), free.end(), 1), 2);
}

}  // namespace
}  // namespace flipfree::unwrap
