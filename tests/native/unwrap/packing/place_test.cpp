#include "flipfree/unwrap/packing/place.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/certify/measures.h"

namespace flipfree::unwrap::place_test {
namespace {

// `count` flat unit squares of two triangles each; chart i is i + 1 times as large.
std::vector<mesh::Chart> squares(Index count) {
  std::vector<mesh::Chart> charts(static_cast<std::size_t>(count));
  for (Index i = 0; i < count; ++i) {
    mesh::Chart& chart = charts[static_cast<std::size_t>(i)];
    chart.surface.vertices.resize(4, 3);
    chart.surface.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
    chart.surface.vertices *= i + 1;
    chart.surface.faces.resize(2, 3);
    chart.surface.faces << 0, 1, 2, 0, 2, 3;
    chart.faces = {2 * i, 2 * i + 1};
  }
  return charts;
}

// Each chart as a square of this side with its lower left corner there.
std::vector<Points2> maps(const std::vector<std::pair<Vector2, double>>& places) {
  std::vector<Points2> uv;
  for (const auto& [low, side] : places) {
    Points2 own(4, 2);
    own << 0, 0, 1, 0, 1, 1, 0, 1;
    uv.emplace_back((own * side).rowwise() + low.transpose());
  }
  return uv;
}

std::vector<Points2f> nearest(const std::vector<Points2>& uv) {
  std::vector<Points2f> stored;
  for (const Points2& own : uv) stored.push_back(own.cast<float>());
  return stored;
}

Points2 corners_of(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& uv) {
  Points2 corners(static_cast<Eigen::Index>(6 * charts.size()), 2);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    for (Eigen::Index f = 0; f < 2; ++f) {
      for (Index k = 0; k < 3; ++k) {
        corners.row(6 * static_cast<Eigen::Index>(c) + 3 * f + k) =
            uv[c].row(charts[c].surface.faces(f, k));
      }
    }
  }
  return corners;
}

double side(const Points2& uv) { return (uv.row(1) - uv.row(0)).norm(); }

TEST(Place, charts_that_32_bits_would_hold_as_a_point_are_enlarged) {
  ExecutionContext context;
  const std::vector<Points2> uv = maps({{Vector2::Zero(), 1.0}, {Vector2::Zero(), 1.0}});
  for (const double size : {1e-5, 1e-9, 1e-30, 1e-200, 1e-300}) {
    std::vector<mesh::Chart> charts = squares(2);
    charts[1].surface.vertices *= 0.5 * size;
    PlacingOptions options;
    options.scale_true = true;
    options.effort = 0.0;
    const PlacedCharts placed = place_charts(charts, uv, {1, 1}, options, nearest, context);
    EXPECT_EQ(placed.enlarged, size < 1e-5 ? 1 : 0) << size;
    EXPECT_TRUE(placed.margin_met);
    const double ratio = side(placed.uv[1]) / side(placed.uv[0]);
    EXPECT_NEAR(ratio, size < 1e-5 ? 0x1p-20 * std::sqrt(2.0) : size, 1e-3 * ratio) << size;
    EXPECT_TRUE(certify::flipped_faces(corners_of(charts, placed.uv)).empty());
  }
}

TEST(Place, charts_get_the_size_of_their_surface_only_if_asked_to) {
  ExecutionContext context;
  const std::vector<mesh::Chart> charts = squares(2);
  const std::vector<Points2> uv = maps({{{0, 0}, 1.0}, {{5, 5}, 1.0}});
  PlacingOptions options;
  EXPECT_NEAR(side(place_charts(charts, uv, {1, 1}, options, nearest, context).uv[1]) /
                  side(place_charts(charts, uv, {1, 1}, options, nearest, context).uv[0]),
              1.0, 1e-12);
  options.scale_true = true;
  const PlacedCharts placed = place_charts(charts, uv, {1, 1}, options, nearest, context);
  EXPECT_NEAR(side(placed.uv[1]) / side(placed.uv[0]), 2.0, 1e-12);
  EXPECT_NEAR(density_of(charts, placed.uv, {1, 1}), side(placed.uv[0]), 1e-12);
}

TEST(Place, charts_that_stay_are_not_touched_and_give_their_density) {
  ExecutionContext context;
  const std::vector<mesh::Chart> charts = squares(3);
  const std::vector<Points2> uv = maps({{{0.4, 0.4}, 0.1}, {{5, 5}, 1.0}, {{0, 0}, 7.0}});
  PlacingOptions options;
  options.scale_true = true;
  const PlacedCharts placed = place_charts(charts, uv, {0, 1, 1}, options, nearest, context);
  EXPECT_EQ(placed.uv[0], uv[0]);
  EXPECT_NEAR(side(placed.uv[1]), 0.2, 1e-12);
  EXPECT_NEAR(side(placed.uv[2]), 0.3, 1e-12);
}

TEST(Place, former_places_are_kept_at_one_scale) {
  ExecutionContext context;
  const std::vector<mesh::Chart> charts = squares(2);
  const std::vector<Points2> former = maps({{{0.1, 0.1}, 0.2}, {{0.5, 0.5}, 0.2}});
  const Points2 corners = corners_of(charts, former);
  PlacingOptions options;
  options.scale_true = true;
  options.place_like = &corners;
  const PlacedCharts placed =
      place_charts(charts, maps({{{0, 0}, 3.0}, {{0, 0}, 4.0}}), {1, 1}, options, nearest, context);
  EXPECT_TRUE(placed.kept);
  EXPECT_NEAR(side(placed.uv[1]) / side(placed.uv[0]), 2.0, 1e-12);
  EXPECT_NEAR(side(placed.uv[0]) * side(placed.uv[0]) + side(placed.uv[1]) * side(placed.uv[1]),
              0.08, 1e-12);
  for (std::size_t c = 0; c < 2; ++c)
    EXPECT_LT((placed.uv[c].colwise().mean() - former[c].colwise().mean()).norm(), 1e-12);
}

TEST(Place, what_is_enlarged_is_counted_at_former_places_too) {
  ExecutionContext context;
  std::vector<mesh::Chart> charts = squares(2);
  charts[1].surface.vertices *= 1e-9;
  const Points2 corners = corners_of(charts, maps({{{0.1, 0.1}, 0.2}, {{0.5, 0.5}, 0.2}}));
  PlacingOptions options;
  options.scale_true = true;
  options.place_like = &corners;
  const PlacedCharts placed =
      place_charts(charts, maps({{{0, 0}, 1.0}, {{0, 0}, 1.0}}), {1, 1}, options, nearest, context);
  EXPECT_TRUE(placed.kept);
  EXPECT_EQ(placed.enlarged, 1);
}

TEST(Place, former_places_that_only_touch_are_free) {
  ExecutionContext context;
  const std::vector<mesh::Chart> charts = squares(1);
  const Points2 corners = corners_of(charts, maps({{{0.25, 0.25}, 0.25}}));
  Points2 beside(3, 2);
  beside << 0.5, 0.0, 1.0, 0.0, 0.5, 1.0;
  PlacingOptions options;
  options.place_like = &corners;
  options.obstacles = &beside;
  const std::vector<Points2> uv = maps({{{0, 0}, 1.0}});
  // The fit may be off by a unit in the last place: stored to 20 bits it is not.
  const RoundCharts coarse = [](const std::vector<Points2>& points) {
    std::vector<Points2f> stored;
    for (const Points2& own : points)
      stored.emplace_back(((own * 0x1p20).array().round() * 0x1p-20).matrix().cast<float>());
    return stored;
  };
  EXPECT_TRUE(place_charts(charts, uv, {1}, options, coarse, context).kept);
  beside(0, 0) -= 0x1p-10;
  beside(2, 0) -= 0x1p-10;
  EXPECT_FALSE(place_charts(charts, uv, {1}, options, coarse, context).kept);
}

TEST(Place, former_places_that_cannot_be_stored_are_given_up) {
  ExecutionContext context;
  const std::vector<mesh::Chart> charts = squares(1);
  const Points2 corners = corners_of(charts, maps({{{0.5, 0.5}, 1e-9}}));
  PlacingOptions options;
  options.place_like = &corners;
  const RoundCharts refuse_small = [](const std::vector<Points2>& uv) {
    if (side(uv[0]) < 1e-3) throw NotConverged({ErrorCode::kRoundingFlips, "too small", {}, {}});
    return nearest(uv);
  };
  const PlacedCharts placed =
      place_charts(charts, maps({{{0, 0}, 1.0}}), {1}, options, refuse_small, context);
  EXPECT_FALSE(placed.kept);
  EXPECT_GT(side(placed.uv[0]), 0.9);
}

}  // namespace
}  // namespace flipfree::unwrap::place_test
