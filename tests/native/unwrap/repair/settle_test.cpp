#include "flipfree/unwrap/repair/settle.h"

#include <gtest/gtest.h>

#include <utility>

#include "flipfree/certify/overlap.h"
#include "support/shapes.h"

namespace flipfree::unwrap::settle_test {
namespace {

// Equal squares, each a chart, at given corners.
struct Squares {
  std::vector<mesh::Chart> charts;
  std::vector<ChartToSettle> mended;
  RepairOptions options;

  void add(double x, double y, double size, Place place) {
    mesh::Chart chart;
    chart.surface = test::grid(2, 2);
    for (FaceId f = 0; f < 8; ++f)
      chart.faces.push_back(static_cast<FaceId>(8 * charts.size()) + f);
    ChartToSettle own;
    own.uv = size * chart.surface.vertices.leftCols<2>();
    own.uv.rowwise() += Eigen::RowVector2d(x, y);
    own.place = place;
    own.kept.bijective = true;
    charts.push_back(std::move(chart));
    mended.push_back(std::move(own));
  }

  SettledCharts settled(bool sized = true) {
    ExecutionContext context;
    return settle(charts, mended, sized, options, context);
  }

  std::int64_t overlaps(const SettledCharts& settled) const {
    mesh::Components all;
    Points2 corners(static_cast<Eigen::Index>(24 * charts.size()), 2);
    for (std::size_t c = 0; c < charts.size(); ++c) {
      all.of_face.insert(all.of_face.end(), 8, all.count++);
      for (Eigen::Index k = 0; k < 24; ++k)
        corners.row(static_cast<Eigen::Index>(24 * c) + k) =
            settled.stored[c].row(charts[c].surface.faces.data()[k]).cast<double>();
    }
    return certify::island_overlaps(all, corners).pairs;
  }
};

TEST(Settle, charts_that_stay_do_even_on_each_other) {
  Squares squares;
  squares.add(0, 0, 0.3, Place::kStays);
  squares.add(0.1, 0.1, 0.3, Place::kStays);
  const SettledCharts settled = squares.settled();
  EXPECT_EQ(settled.uv[0], squares.mended[0].uv);
  EXPECT_EQ(settled.uv[1], squares.mended[1].uv);
}

TEST(Settle, charts_without_a_place_get_one_at_their_size) {
  Squares squares;
  squares.add(0, 0, 0.5, Place::kStays);
  squares.add(0, 0, 0.25, Place::kNone);
  const SettledCharts settled = squares.settled();
  EXPECT_EQ(squares.overlaps(settled), 0);
  EXPECT_NEAR(settled.uv[1].col(0).maxCoeff() - settled.uv[1].col(0).minCoeff(), 0.25, 1e-9);
  EXPECT_LE(settled.uv[1].maxCoeff(), 1.0);
}

TEST(Settle, where_the_square_is_full_they_go_beside_it) {
  Squares squares;
  squares.add(0, 0, 1.0, Place::kStays);
  squares.add(0, 0, 0.25, Place::kNone);
  squares.add(0, 0, 1.5, Place::kNone);
  const SettledCharts settled = squares.settled();
  EXPECT_EQ(squares.overlaps(settled), 0);
  for (const std::size_t c : {1u, 2u}) {
    EXPECT_GE(settled.uv[c].col(0).minCoeff(), 1.0);
    EXPECT_NEAR(settled.uv[c].col(0).maxCoeff() - settled.uv[c].col(0).minCoeff(),
                c == 1 ? 0.25 : 1.5, 1e-9);
  }
}

TEST(Settle, a_chart_near_its_place_moves_only_if_it_lies_on_others) {
  Squares squares;
  squares.add(0, 0, 0.3, Place::kStays);
  squares.add(0.6, 0.6, 0.3, Place::kWhereItWas);
  squares.add(0.2, 0.2, 0.3, Place::kWhereItWas);
  const SettledCharts settled = squares.settled();
  EXPECT_EQ(settled.moved, (std::vector<char>{0, 0, 1}));
  EXPECT_EQ(squares.overlaps(settled), 0);
}

TEST(Settle, a_chart_that_was_made_better_may_lie_on_what_it_lay_on) {
  Squares squares;
  squares.add(0, 0, 0.3, Place::kStays);
  squares.add(0.2, 0.2, 0.3, Place::kWhereItWas);
  squares.mended[1].before = squares.mended[1].uv;
  EXPECT_EQ(squares.settled().moved, (std::vector<char>{0, 0}));
  squares.mended[1].before.array() += 1.0;
  EXPECT_EQ(squares.settled().moved, (std::vector<char>{0, 1}));
}

TEST(Settle, disjoint_moves_what_lies_on_others_but_no_pins) {
  Squares squares;
  squares.options.disjoint = true;
  squares.add(0, 0, 0.3, Place::kStays);
  squares.add(0.1, 0.1, 0.3, Place::kStays);
  squares.mended[1].kept.fixed = {0};
  squares.add(0.15, 0.15, 0.3, Place::kStays);
  const SettledCharts settled = squares.settled();
  EXPECT_EQ(settled.moved, (std::vector<char>{1, 0, 1}));
  EXPECT_EQ(squares.overlaps(settled), 0);
}

TEST(Settle, charts_without_a_size_fill_the_square) {
  Squares squares;
  squares.add(0, 0, 40.0, Place::kNone);
  squares.add(0, 0, 40.0, Place::kNone);
  const SettledCharts settled = squares.settled(false);
  EXPECT_EQ(squares.overlaps(settled), 0);
  for (const Points2& uv : settled.uv) EXPECT_LE(uv.maxCoeff(), 1.0);
}

TEST(Settle, what_32_bits_do_not_hold_is_named) {
  Squares squares;
  squares.add(0, 0, 0.3, Place::kStays);
  squares.add(1e6, 1e6, 1e-6, Place::kStays);
  EXPECT_EQ(squares.settled().unstorable, (std::vector<std::size_t>{1}));
}

}  // namespace
}  // namespace flipfree::unwrap::settle_test
