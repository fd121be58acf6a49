#include "flipfree/unwrap/packing/pack.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "flipfree/base/error.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::pack_test {
namespace {

// Three grids of different size, each a chart, all in one place in the plane.
struct Case {
  mesh::Surface surface;
  Points2 uv;
  PackOptions options;
  ExecutionContext context;
  Case() {
    const mesh::Surface one = test::grid(3, 3);
    surface.vertices.resize(48, 3);
    surface.faces.resize(54, 3);
    for (Index c = 0; c < 3; ++c) {
      surface.vertices.middleRows<16>(16 * c) = (1.0 + c) * one.vertices;
      surface.faces.middleRows<18>(18 * c) = one.faces.array() + 16 * c;
    }
    uv = test::flat(surface);
  }
  certify::Parametrization pack() { return unwrap::pack(surface, uv, options, context); }
  ErrorCode refusal() {
    try {
      pack();
    } catch (const InvalidInput& e) {
      return e.error().code;
    }
    return ErrorCode::kInternal;
  }
};

// The similarity that takes one triangle's corners to the others': length ratio of all edges.
double scale_of(const Points2& from, const Points2& to, Index first, Index count) {
  const auto span = [&](const Points2& p) {
    return (p.middleRows(first, count).rowwise() - p.row(first)).norm();
  };
  return span(to) / span(from);
}

TEST(Pack, charts_become_disjoint_in_the_unit_square_by_similarities) {
  for (const bool scale_true : {false, true}) {
    Case c;
    c.options.scale_true = scale_true;
    c.uv.topRows(54) *= 2.0;  // the first chart is drawn too large
    const certify::Parametrization map = c.pack();
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(map.certificate.island_overlaps, 0);
    EXPECT_GE(map.uv32.minCoeff(), 0.0F);
    EXPECT_LE(map.uv32.maxCoeff(), 1.0F);
    std::array<double, 3> scale{};
    for (Index chart = 0; chart < 3; ++chart) {
      scale[static_cast<std::size_t>(chart)] = scale_of(c.uv, map.uv, 54 * chart, 54);
      for (CornerId a = 54 * chart; a < 54 * chart + 54; ++a) {
        const CornerId b = 54 * chart;
        EXPECT_NEAR((map.uv.row(a) - map.uv.row(b)).norm(),
                    scale[static_cast<std::size_t>(chart)] * (c.uv.row(a) - c.uv.row(b)).norm(),
                    1e-9);
      }
    }
    EXPECT_NEAR(scale[1] / scale[2], 1.0, 1e-9);
    EXPECT_NEAR(scale[0] / scale[1], scale_true ? 0.5 : 1.0, 1e-9);
  }
}

TEST(Pack, charts_with_unmoved_corners_stay_bit_for_bit_and_the_others_keep_clear) {
  Case c;
  c.uv /= 8.0;
  c.options.unmoved = {60};
  const certify::Parametrization map = c.pack();
  EXPECT_EQ(map.uv.middleRows(54, 54), c.uv.middleRows(54, 54));
  EXPECT_EQ(map.certificate.island_overlaps, 0);
}

TEST(Pack, obstacles_are_kept_clear_of) {
  Case c;
  c.options.obstacles.resize(3, 2);
  c.options.obstacles << 0, 0, 1, 0, 0, 1;  // half of the square
  const certify::Parametrization map = c.pack();
  EXPECT_TRUE(map.certificate.ok);
  // What is left is beyond the diagonal, or in another tile.
  for (CornerId corner = 0; corner < map.uv.rows(); ++corner)
    EXPECT_GT(map.uv.row(corner).sum(), 1.0);
}

TEST(Pack, wrong_options_are_refused) {
  {
    Case c;
    c.options.unmoved = {162};
    EXPECT_EQ(c.refusal(), ErrorCode::kIndexOutOfRange);
  }
  {
    Case c;
    c.options.obstacles.setZero(4, 2);
    EXPECT_EQ(c.refusal(), ErrorCode::kBadShape);
  }
  {
    Case c;
    c.options.obstacles = Points2::Constant(3, 2, std::numeric_limits<double>::infinity());
    EXPECT_EQ(c.refusal(), ErrorCode::kNotFinite);
  }
  {
    Case c;
    const Points2 like = c.uv.topRows(3);
    c.options.place_like = &like;
    EXPECT_EQ(c.refusal(), ErrorCode::kBadShape);
    c.options.place_like = &c.uv;
    c.options.together = true;
    EXPECT_EQ(c.refusal(), ErrorCode::kBadOption);
  }
  {
    Case c;
    c.uv.row(4) = c.uv.row(3);
    EXPECT_EQ(c.refusal(), ErrorCode::kFlippedMap);
  }
}

}  // namespace
}  // namespace flipfree::unwrap::pack_test
