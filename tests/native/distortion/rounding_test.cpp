#include "flipfree/distortion/rounding.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "support/shapes.h"

namespace flipfree::distortion::rounding_test {
namespace {

Points2 plan(const mesh::Surface& surface) { return surface.vertices.leftCols<2>(); }

std::int64_t repaired(const Stats& stats) {
  return std::get<std::int64_t>(stats.at("rounding.repaired"));
}

bool stored_flip_free(const Triangles& faces, const Points2f& uv) {
  return is_flip_free(faces, uv.cast<double>(), ExecutionContext());
}

// Its nearest floats are as near as one likes.
TEST(Rounding, AVertexAtTheOriginHasOtherPlacesToo) {
  Triangles faces(4, 3);
  faces << 0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1;
  Points2 uv(5, 2);
  uv << 0, 0, 1e-46, 0, 0, 1, -1, 0, 0, -1;  // the first neighbour falls on the origin
  ExecutionContext context;
  Stats stats;
  const Points2f stored = round_to_storage(faces, uv, {}, context, stats);
  EXPECT_TRUE(stored_flip_free(faces, stored));
}

// A grid far from the origin, turned, whose cells shrink to `cell` and below the spacing of 32-bit
// numbers in the middle.
Points2 crowded(const mesh::Surface& grid, double cell) {
  Points2 uv = plan(grid);
  for (double& coordinate : uv.reshaped()) {
    const double x = coordinate - 0.5;
    coordinate = std::pow(2.0 * x, 7) + cell * x;
  }
  Points2 turned(uv.rows(), 2);
  turned.col(0) = 2.3 + std::cos(0.5) * uv.col(0).array() - std::sin(0.5) * uv.col(1).array();
  turned.col(1) = 1.7 + std::sin(0.5) * uv.col(0).array() + std::cos(0.5) * uv.col(1).array();
  return turned;
}

TEST(Rounding, TrianglesBelowTheSpacingOfFloatsAreOpened) {
  const mesh::Surface surface = test::grid(40, 40);
  for (const double cell : {1e-6, 1e-9, 1e-12}) {
    SCOPED_TRACE(cell);
    const Points2 uv = crowded(surface, cell);
    ExecutionContext context;
    ASSERT_TRUE(is_flip_free(surface.faces, uv, context));
    ASSERT_FALSE(stored_flip_free(surface.faces, uv.cast<float>()));
    Stats stats;
    const Points2f stored = round_to_storage(surface.faces, uv, {}, context, stats);
    EXPECT_TRUE(stored_flip_free(surface.faces, stored));
    EXPECT_GT(repaired(stats), 0);
    EXPECT_LT(repaired(stats), 600);
    EXPECT_LT((stored.cast<double>() - uv).cwiseAbs().maxCoeff(), 1e-2);
  }
}

// Rows less than a spacing of 32-bit numbers apart: where rounding folds triangles, vertices move
// as far as it takes, and on to where the map is least distorted.
TEST(Rounding, WhatIsMovedComesToLieWhereItIsLeastDistorted) {
  const mesh::Surface surface = test::grid(20, 20);
  Points2 uv = plan(surface);
  uv.col(1) = uv.col(1) * (20 * 0.9 * 0x1p-23) + Eigen::VectorXd::Ones(uv.rows());
  uv.col(0) += 1e3 * (uv.col(1) - Eigen::VectorXd::Ones(uv.rows()));
  uv.col(1) += 0.4 * uv.col(0);
  ExecutionContext context;
  ASSERT_TRUE(is_flip_free(surface.faces, uv, context));
  Stats stats;
  const Points2 stored = round_to_storage(surface.faces, uv, {}, context, stats).cast<double>();
  EXPECT_GT(repaired(stats), 50);
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const auto sides = [&](const Points2& p) {
      Eigen::Matrix2d both;
      both << p.row(surface.faces(f, 1)) - p.row(surface.faces(f, 0)),
          p.row(surface.faces(f, 2)) - p.row(surface.faces(f, 0));
      return both;
    };
    const Eigen::Matrix2d jacobian = sides(uv).inverse() * sides(stored);
    EXPECT_LT((jacobian.squaredNorm() + jacobian.inverse().squaredNorm()) / 4.0, 20.0) << f;
  }
}

TEST(Rounding, ImpossibleMapsAreRefusedAndNamed) {
  // All corners of a triangle are fixed within one 32-bit step.
  const mesh::Surface surface = test::grid(4, 4);
  Points2 uv = plan(surface);
  RoundingOptions options;
  for (Index v = 0; v < static_cast<Index>(uv.rows()); ++v) options.fixed.push_back(v);
  uv *= 1e-9;
  uv.array() += 1.0;
  ExecutionContext context;
  ASSERT_TRUE(is_flip_free(surface.faces, uv, context));
  Stats stats;
  try {
    round_to_storage(surface.faces, uv, options, context, stats);
    FAIL() << "collapsed triangles were accepted";
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kRoundingFlips);
    EXPECT_EQ(e.error().kind, ElementKind::kFace);
    EXPECT_FALSE(e.error().elements.empty());
  }
}

TEST(Rounding, WhatCannotBeStoredEndsTheSearchInItsOwnPiece) {
  // Two pieces that no triangle joins. In the second a vertex lies within a triangle of three
  // neighbouring 32-bit points, which are fixed.
  Triangles faces(4, 3);
  faces << 0, 1, 2, 3, 4, 6, 4, 5, 6, 5, 3, 6;
  const double step = 0x1p-23;
  Points2 uv(7, 2);
  uv << 0, 0, 1, 0, 0, 1, 1, 1, 1 + step, 1, 1, 1 + step, 1 + step / 3, 1 + step / 3;
  RoundingOptions options;
  options.fixed = {3, 4, 5};
  ExecutionContext context;
  ASSERT_TRUE(is_flip_free(faces, uv, context));
  Stats stats;
  const TimeLimit limit(context, 60.0);
  try {
    round_to_storage(faces, uv, options, context, stats);
    FAIL() << "a collapsed triangle was accepted";
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kRoundingFlips);
  }
}

}  // namespace
}  // namespace flipfree::distortion::rounding_test
