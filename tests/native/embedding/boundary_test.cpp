#include "flipfree/embedding/disk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::embedding::boundary_test {
namespace {

std::vector<VertexId> iota_loop(Index count) {
  std::vector<VertexId> loop(static_cast<std::size_t>(count));
  std::iota(loop.begin(), loop.end(), 0);
  return loop;
}

TEST(Boundary, CircleIsStrictlyConvexAndOfStoredNumbersWhereTheseAreDenseEnough) {
  for (const Index count : {3, 4, 5, 7, 100, 3000, 30000, 300000}) {
    const std::vector<double> lengths(static_cast<std::size_t>(count), 1.0);
    const Points2 p = place_boundary(BoundaryShape::kCircle, lengths);
    EXPECT_EQ(p == as_stored(p), count <= 3000) << count;
    EXPECT_TRUE(is_strictly_convex(p)) << count;
    EXPECT_NEAR(p.rowwise().norm().minCoeff(), 1.0, 1e-7) << count;
    EXPECT_LE(p.rowwise().norm().maxCoeff(), 1.0 + 1e-7) << count;
    require_convex(p, iota_loop(count));
  }
}

TEST(Boundary, CircleWithEdgesOfWildlyDifferentLengthStaysStrictlyConvex) {
  std::vector<double> lengths;
  for (int i = 0; i < 2000; ++i) lengths.push_back(std::pow(10.0, -(i * 7 % 13)));
  const Points2 p = place_boundary(BoundaryShape::kCircle, lengths);
  EXPECT_EQ(p, as_stored(p));
  EXPECT_TRUE(is_strictly_convex(p));
}

TEST(Boundary, SquareAndTriangleHaveAPointInEveryCornerAndDistinctStoredPoints) {
  std::vector<double> lengths(57, 1.0);
  lengths[3] = 1e-12;
  for (const auto shape : {BoundaryShape::kSquare, BoundaryShape::kTriangle}) {
    const Points2 p = place_boundary(shape, lengths);
    EXPECT_EQ(p, as_stored(p));
    std::set<std::pair<double, double>> distinct;
    for (Index i = 0; i < p.rows(); ++i) distinct.emplace(p(i, 0), p(i, 1));
    EXPECT_EQ(distinct.size(), lengths.size());
    // A point lies in each corner: nothing else is as far out.
    const Eigen::VectorXd radius = p.rowwise().norm();
    const Index corners = static_cast<Index>((radius.array() > radius.maxCoeff() - 1e-6).count());
    EXPECT_EQ(corners, shape == BoundaryShape::kSquare ? 4 : 3);
    EXPECT_NEAR(radius.maxCoeff(), shape == BoundaryShape::kSquare ? std::sqrt(2.0) : 1.0, 1e-6);
    EXPECT_NO_THROW(require_convex(p, iota_loop(57)));
  }
}

TEST(Boundary, WrongPolygonsAreNamed) {
  const auto code = [](const Points2& p) {
    try {
      require_convex(p, iota_loop(static_cast<Index>(p.rows())));
    } catch (const InvalidInput& e) {
      return e.error().code;
    }
    return ErrorCode::kInternal;
  };
  Points2 dent(5, 2);
  dent << 0, 0, 4, 0, 4, 4, 2, 1, 0, 4;
  EXPECT_EQ(code(dent), ErrorCode::kNotConvex);
  Points2 clockwise(3, 2);
  clockwise << 0, 0, 0, 1, 1, 0;
  EXPECT_EQ(code(clockwise), ErrorCode::kNotConvex);
  Points2 repeated(4, 2);
  repeated << 0, 0, 1, 0, 1, 0, 0, 1;
  EXPECT_EQ(code(repeated), ErrorCode::kBadBoundary);
  Points2 line(3, 2);
  line << 0, 0, 1, 0, 2, 0;
  EXPECT_EQ(code(line), ErrorCode::kNotConvex);
  Points2 twice(10, 2);  // pentagram: every turn is left, but it winds twice
  for (int i = 0; i < 10; ++i) {
    const double angle = 2 * std::numbers::pi * i / 5;
    twice.row(i) << std::cos(angle) * (1 + 0.01 * (i / 5)), std::sin(angle) * (1 + 0.01 * (i / 5));
  }
  EXPECT_EQ(code(twice), ErrorCode::kNotConvex);
  Points2 infinite(3, 2);
  infinite << 0, 0, INFINITY, 0, 0, 1;
  EXPECT_EQ(code(infinite), ErrorCode::kNotFinite);
}

}  // namespace
}  // namespace flipfree::embedding::boundary_test
