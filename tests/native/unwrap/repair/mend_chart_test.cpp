#include "flipfree/unwrap/repair/mend_chart.h"

#include <gtest/gtest.h>

#include <numeric>

#include "flipfree/base/error.h"
#include "flipfree/certify/measures.h"
#include "support/shapes.h"

namespace flipfree::unwrap::mend_chart_test {
namespace {

// A sheet as the only chart of its map.
struct Only {
  mesh::Chart chart;
  std::vector<VertexId> origin;
  Points2 places;
  std::vector<char> unknown;
  std::vector<std::pair<VertexId, Vector2>> pins;
  double density = 0.0;
  RepairOptions options;

  explicit Only(Index cells) {
    chart.surface = test::bumpy_grid(cells, cells, 0.1, 2.0);
    chart.faces.resize(static_cast<std::size_t>(chart.surface.faces.rows()));
    std::iota(chart.faces.begin(), chart.faces.end(), 0);
    chart.vertices.resize(static_cast<std::size_t>(chart.surface.vertices.rows()));
    std::iota(chart.vertices.begin(), chart.vertices.end(), 0);
    origin = chart.vertices;
    places = chart.surface.vertices.leftCols<2>();
    unknown.assign(origin.size(), 0);
  }

  MendedChart mend(bool anew = false) const {
    const mesh::EdgeFlags seams(3 * chart.faces.size(), 0);
    ExecutionContext context;
    return mend_chart({chart, origin, places, unknown, pins, seams, {}, density}, options, anew,
                      context);
  }
  Points2 corners() const {
    Points2 uv(chart.surface.faces.size(), 2);
    for (Eigen::Index c = 0; c < uv.rows(); ++c)
      uv.row(c) = places.row(chart.surface.faces.data()[c]);
    return uv;
  }
};

TEST(MendChart, no_damage_no_change) {
  const Only only(6);
  const MendedChart mended = only.mend();
  EXPECT_EQ(mended.change, Change::kNone);
  EXPECT_EQ(mended.uv, only.corners());
}

TEST(MendChart, the_least_that_helps_is_done) {
  Only only(8);
  const Points2 sound = only.places;
  only.places.col(0) *= -1.0;
  EXPECT_EQ(only.mend().change, Change::kMirrored);
  only.places = sound;
  only.places.row(40) << 3.0, 3.0;
  EXPECT_EQ(only.mend().change, Change::kUnfolded);
  only.places.setZero();
  EXPECT_EQ(only.mend().change, Change::kAnew);
  EXPECT_FALSE(only.mend().has_density);
  only.density = 2.0;
  EXPECT_TRUE(only.mend().has_density);
  EXPECT_EQ(only.mend().place.front(), Place::kNone);
}

TEST(MendChart, a_chart_wrong_side_up_keeps_its_shape_unless_that_is_poor) {
  for (const double stretch : {3.0, 15.0}) {
    Only only(8);
    only.places.col(0) *= -stretch;
    EXPECT_EQ(only.mend().change, stretch < 9.0 ? Change::kMirrored : Change::kAnew);
  }
}

TEST(MendChart, anew_keeps_place_and_size) {
  Only only(8);
  only.places *= 0.25;
  only.places.rowwise() += Eigen::RowVector2d(4.0, 2.0);
  const MendedChart mended = only.mend(true);
  EXPECT_EQ(mended.change, Change::kAnew);
  EXPECT_EQ(mended.place.front(), Place::kWhereItWas);
  EXPECT_LT((mended.uv - only.corners()).rowwise().norm().maxCoeff(), 0.02);
}

TEST(MendChart, density_is_known_of_healthy_charts_only) {
  Only only(8);
  only.places *= 3.0;
  EXPECT_NEAR(own_density(only.chart, only.places).value, 3.0, 0.3);
  EXPECT_EQ(own_density(only.chart, Points2::Zero(81, 2)).value, 0.0);
}

TEST(MendChart, pins_that_fold_are_named_by_vertices_of_the_surface) {
  Only only(4);
  only.origin.assign(only.origin.size(), 0);
  for (std::size_t v = 0; v < only.origin.size(); ++v)
    only.origin[v] = static_cast<VertexId>(1000 + v);
  std::swap(only.places(11, 0), only.places(13, 0));
  for (VertexId v = 0; v < only.places.rows(); ++v)
    only.pins.emplace_back(v, only.places.row(v).transpose());
  try {
    only.mend();
    FAIL();
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().kind, ElementKind::kFace);
    EXPECT_EQ(e.error().elements, std::vector<Index>{0});
    EXPECT_NE(e.error().message.find("pins"), std::string::npos) << e.error().message;
  }
}

}  // namespace
}  // namespace flipfree::unwrap::mend_chart_test
