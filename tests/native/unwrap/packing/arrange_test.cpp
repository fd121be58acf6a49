#include "flipfree/unwrap/packing/arrange.h"

#include <gtest/gtest.h>

namespace flipfree::unwrap::arrange_test {
namespace {

mesh::Chart square(Index first) {
  mesh::Chart chart;
  chart.surface.vertices.setZero(4, 3);
  chart.surface.faces.resize(2, 3);
  chart.surface.faces << 0, 1, 2, 0, 2, 3;
  chart.faces = {first, first + 1};
  return chart;
}

struct Two {
  std::vector<mesh::Chart> charts = {square(0), square(2)};
  std::vector<Points2> uv;
  ExecutionContext context;
  Two() {
    for (const double x : {0.0, 1.5}) {
      Points2 own(4, 2);
      own << x, 0, x + 1, 0, x + 1, 1, x, 1;
      uv.push_back(own);
    }
  }
  const std::vector<Points2>& stored() const { return uv; }
};

TEST(Arrange, items_move_as_one) {
  Two two;
  arrange(two.charts, {{0, 1}}, {}, two.uv, two.context);
  const double side = (two.uv[0].row(1) - two.uv[0].row(0)).norm();
  EXPECT_NEAR((two.uv[1].row(0) - two.uv[0].row(0)).norm(), 1.5 * side, 1e-9);
}

TEST(Arrange, the_first_tile_is_where_it_is_asked_for) {
  Two two;
  ArrangeOptions options;
  options.first_tile = 12;
  EXPECT_EQ(arrange(two.charts, {{0}, {1}}, options, two.uv, two.context), 12);
  for (const Points2& own : two.uv) {
    EXPECT_GT(own.col(0).minCoeff(), 2.0);
    EXPECT_LT(own.col(1).maxCoeff(), 2.0);
    EXPECT_GT(own.col(1).minCoeff(), 1.0);
  }
}

TEST(Arrange, gaps_are_measured_on_stored_values) {
  Two two;
  EXPECT_TRUE(apart(two.charts, {{0}, {1}}, two.stored(), Points2(0, 2), 0.49, two.context));
  EXPECT_FALSE(apart(two.charts, {{0}, {1}}, two.stored(), Points2(0, 2), 0.51, two.context));
  Points2 near(3, 2);
  near << 0, 1.25, 1, 2, 0, 2;
  EXPECT_FALSE(apart(two.charts, {{0}, {1}}, two.stored(), near, 0.3, two.context));
  EXPECT_TRUE(apart(two.charts, {{0, 1}}, two.stored(), Points2(0, 2), 0.51, two.context));
}

}  // namespace
}  // namespace flipfree::unwrap::arrange_test
