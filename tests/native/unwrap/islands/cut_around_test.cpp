#include "flipfree/unwrap/islands/cut_around.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::cut_around_test {
namespace {

struct Sheet {
  mesh::Surface surface = test::grid(8, 8);
  mesh::Adjacency adjacency = test::adjacency_of(surface);
  Islands islands = [this] {
    ExecutionContext context;
    const mesh::EdgeFlags none(static_cast<std::size_t>(surface.faces.size()), 0);
    return make_islands(surface, adjacency, none, {}, false, context);
  }();

  mesh::EdgeFlags cut(const std::vector<FaceId>& faces, Index rings,
                      const mesh::EdgeFlags& uncuttable = {}) const {
    return cut_around(islands, 0, faces, rings, surface, adjacency, uncuttable);
  }
  // Faces of each part after the cut, ascending.
  std::vector<std::size_t> parts(const mesh::EdgeFlags& further) const {
    Islands cut = islands;
    cut_further(cut, surface, adjacency, further);
    std::vector<std::size_t> sizes;
    for (const mesh::Chart& chart : cut.charts) sizes.push_back(chart.faces.size());
    std::sort(sizes.begin(), sizes.end());
    return sizes;
  }
};

TEST(CutAround, takes_the_named_faces_and_their_rings) {
  const Sheet sheet;
  EXPECT_EQ(sheet.parts(sheet.cut({60}, 0)), (std::vector<std::size_t>{1, 127}));
  const std::vector<std::size_t> one = sheet.parts(sheet.cut({60}, 1));
  ASSERT_EQ(one.size(), 2U);
  EXPECT_EQ(one[0], 13U);  // the faces that share a vertex with one inside a grid
}

TEST(CutAround, halves_the_chart_where_nothing_is_named_or_all_of_it) {
  const Sheet sheet;
  for (const auto& flags : {sheet.cut({}, 3), sheet.cut({60}, 100)}) {
    const std::vector<std::size_t> parts = sheet.parts(flags);
    EXPECT_EQ(*std::max_element(parts.begin(), parts.end()), 64U);
  }
}

TEST(CutAround, spares_diagonals_of_polygons) {
  const Sheet sheet;
  mesh::EdgeFlags diagonals(sheet.adjacency.opposite.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(diagonals.size()); ++h) {
    const HalfedgeId o = sheet.adjacency.opposite[static_cast<std::size_t>(h)];
    diagonals[static_cast<std::size_t>(h)] = o != kInvalid && o / 6 == h / 6;  // of one quad
  }
  const mesh::EdgeFlags flags = sheet.cut({60}, 0, diagonals);
  EXPECT_EQ(sheet.parts(flags), (std::vector<std::size_t>{2, 126}));
  for (std::size_t h = 0; h < flags.size(); ++h) EXPECT_FALSE(flags[h] && diagonals[h]);
}

TEST(CutAround, one_polygon_is_never_cut) {
  const Sheet sheet;
  const mesh::EdgeFlags all(sheet.adjacency.opposite.size(), 1);
  const mesh::EdgeFlags flags = sheet.cut({60}, 0, all);
  EXPECT_EQ(std::count(flags.begin(), flags.end(), 1), 0);
}

}  // namespace
}  // namespace flipfree::unwrap::cut_around_test
