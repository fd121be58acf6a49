#include "flipfree/unwrap/packing/arrange.h"

#include <gtest/gtest.h>

#include <set>

#include "support/shapes.h"

namespace flipfree::unwrap::spread_test {
namespace {

// Squares side by side, of these sides.
struct Squares {
  std::vector<mesh::Chart> charts;
  std::vector<Points2> uv;
  Items items;
  ExecutionContext context;

  explicit Squares(const std::vector<double>& sides) {
    for (const double side : sides) {
      mesh::Chart& chart = charts.emplace_back();
      chart.surface = test::grid(1, 1);
      items.push_back({charts.size() - 1});
      uv.emplace_back(side * chart.surface.vertices.leftCols<2>());
    }
  }
  double side(std::size_t c) const { return (uv[c].row(1) - uv[c].row(0)).norm(); }
};

TEST(Spread, equal_squares_fill_a_tile_each) {
  Squares squares({1, 1, 1, 1});
  ArrangeOptions options;
  options.margin = 0.01;
  options.first_tile = 8;
  const std::vector<Index> tile =
      spread(squares.charts, squares.items, options, 4, squares.uv, squares.context);
  EXPECT_EQ(std::set<Index>(tile.begin(), tile.end()), (std::set<Index>{8, 9, 10, 11}));
  for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(squares.side(c), 0.99, 1e-3);
}

TEST(Spread, the_fullest_tile_sets_the_scale_of_all) {
  Squares squares({3, 1, 1});
  const std::vector<Index> tile =
      spread(squares.charts, squares.items, {}, 2, squares.uv, squares.context);
  EXPECT_NE(tile[0], tile[1]);
  EXPECT_EQ(tile[1], tile[2]);
  EXPECT_NEAR(squares.side(0), 3 * squares.side(1), 1e-9);
  EXPECT_NEAR(squares.side(1), squares.side(2), 1e-9);
}

TEST(Spread, there_are_no_more_tiles_than_items) {
  Squares squares({1, 1});
  const std::vector<Index> tile =
      spread(squares.charts, squares.items, {}, 50, squares.uv, squares.context);
  EXPECT_EQ(std::set<Index>(tile.begin(), tile.end()), (std::set<Index>{0, 1}));
}

TEST(Spread, nothing_needs_no_tile) {
  Squares squares({});
  EXPECT_TRUE(spread(squares.charts, squares.items, {}, 3, squares.uv, squares.context).empty());
}

}  // namespace
}  // namespace flipfree::unwrap::spread_test
