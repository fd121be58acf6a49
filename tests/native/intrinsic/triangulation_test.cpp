#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <vector>

#include "flipfree/intrinsic/delaunay_test.h"
#include "flipfree/intrinsic/refined_start/delaunay_refinement.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"
#include "flipfree/numeric/scalar.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::triangulation_test {
namespace {

using numeric::BigFloat;

// Intrinsic Delaunay refinement: angles of the refined start, and provenance of its vertices.
constexpr double kPi = std::numbers::pi;

// A prism over a regular polygon as CAD programs write it: long needles around, caps fanned from
// one vertex.
mesh::Surface prism(Index sectors, double height, bool closed) {
  mesh::Surface s;
  s.vertices.resize(2 * sectors, 3);
  for (Index i = 0; i < sectors; ++i) {
    const double a = 2 * kPi * i / sectors;
    s.vertices.row(i) << std::cos(a), std::sin(a), 0;
    s.vertices.row(sectors + i) << std::cos(a), std::sin(a), height;
  }
  const Index caps = closed ? 2 : 1;
  Triangles faces(2 * sectors + caps * (sectors - 2), 3);
  Index f = 0;
  for (Index i = 0; i < sectors; ++i) {
    const Index j = (i + 1) % sectors;
    faces.row(f++) << i, j, sectors + j;
    faces.row(f++) << i, sectors + j, sectors + i;
  }
  for (Index i = 1; i + 1 < sectors; ++i) {
    faces.row(f++) << 0, i + 1, i;
    if (closed) faces.row(f++) << sectors, sectors + i, sectors + i + 1;
  }
  s.faces = std::move(faces);
  return s;
}

struct Refined {
  FlatSurface input;
  RefinementPoints found;
  SplitSurface split;
};
Refined refine(const mesh::Surface& s, RefinementOptions options = {}) {
  ExecutionContext context;
  Refined r{make_flat_surface(static_cast<Index>(s.vertices.rows()), s.faces,
                              lengths_of(s.vertices, s.faces)),
            {},
            {}};
  r.found = find_refinement_points(r.input, options, context);
  EXPECT_TRUE(split_surface(r.input, r.found.points, context, r.split));
  return r;
}

class Prisms : public testing::TestWithParam<bool> {};

TEST_P(Prisms, LoseTheirNeedles) {
  const RefinementOptions options;
  const Refined r = refine(prism(120, 3.0, GetParam()), options);
  EXPECT_LT(r.found.smallest_angle, 0.1);
  EXPECT_TRUE(r.found.complete);
  EXPECT_GT(r.found.points.size(), 100u);
  // The Delaunay triangulation of what was written, not of what the refinement believed.
  ExecutionContext context;
  const FlatSurface after = make_flat_surface(r.split.vertex_count, r.split.faces, r.split.lengths);
  const RefinementPoints again = find_refinement_points(after, options, context);
  EXPECT_GT(again.smallest_angle, 0.999 * options.least_angle);
}

TEST_P(Prisms, AreTheSameSurfaceAfterwards) {
  const Refined r = refine(prism(60, 3.0, GetParam()));
  const FlatSurface after = make_flat_surface(r.split.vertex_count, r.split.faces, r.split.lengths);
  for (VertexId v = 0; v < r.input.vertex_count; ++v) {
    EXPECT_NEAR(after.total_angle[at(v)], r.input.total_angle[at(v)], 1e-9) << v;
  }
  for (VertexId v = r.input.vertex_count; v < after.vertex_count; ++v) {
    const bool boundary = r.split.added_on_boundary[at(v - r.input.vertex_count)] != 0;
    EXPECT_EQ(after.on_boundary(v), boundary);
    EXPECT_NEAR(after.total_angle[at(v)], boundary ? kPi : 2 * kPi, 1e-9) << v;
  }
}

TEST_P(Prisms, KnowExactlyWhereTheirNewVerticesLie) {
  const Refined r = refine(prism(60, 3.0, GetParam()));
  ASSERT_FALSE(r.split.added.empty());
  for (const mesh::SurfacePoint& v : r.split.added) {
    EXPECT_EQ(v.weight[0] + v.weight[1] + v.weight[2], 1.0);
    EXPECT_GE(v.weight.minCoeff(), 0.0);
    for (int k = 0; k < 3; ++k) {
      const double steps = std::ldexp(v.weight[k], 52);
      EXPECT_EQ(steps, std::round(steps));
    }
  }
  // Positive in the parent, and pieces of every side from end to end.
  const auto weight = [&](FaceId parent, VertexId v) -> Vector3 {
    if (v < r.input.vertex_count) {
      for (int k = 0; k < 3; ++k) {
        if (r.input.faces(parent, k) == v) return Vector3::Unit(k);
      }
    }
    const mesh::SurfacePoint& a = r.split.added[at(v - r.input.vertex_count)];
    if (a.face == parent) return a.weight;
    Vector3 w = Vector3::Zero();  // on an edge: weights go by vertex
    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l < 3; ++l) {
        if (r.input.faces(parent, k) == r.input.faces(a.face, l)) w[k] = a.weight[l];
      }
    }
    return w;
  };
  std::vector<double> area(at(static_cast<Index>(r.input.faces.rows())), 0.0);
  for (Index f = 0; f < r.split.faces.rows(); ++f) {
    Eigen::Matrix3d m;
    for (int k = 0; k < 3; ++k)
      m.row(k) = weight(r.split.parent_face[at(f)], r.split.faces(f, k)).transpose();
    EXPECT_GT(m.determinant(), 0.0) << f;
    area[at(r.split.parent_face[at(f)])] += m.determinant();
  }
  for (const double a : area) EXPECT_NEAR(a, 1.0, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Refinement, Prisms, testing::Values(true, false));

TEST(Refinement, StopsAtItsLimitAndSaysSo) {
  RefinementOptions options;
  options.max_added = 20;
  const Refined r = refine(prism(120, 3.0, true), options);
  EXPECT_FALSE(r.found.complete);
  EXPECT_EQ(r.found.points.size(), 20u);
  EXPECT_EQ(r.split.vertex_count, 240 + 20);
}

TEST(DelaunayTest, SignsOfKitesAreThoseOfTheirAngles) {
  const double side = std::sqrt(0.5);
  EXPECT_EQ(delaunay_sign(1.0, 1.0, 1.0, 1.0, 1.0), 1);
  EXPECT_EQ(delaunay_sign(1.0, 0.6, 0.6, 0.6, 0.6), -1);
  EXPECT_EQ(delaunay_sign(1.0, side, side, side, side), 0);
  EXPECT_FALSE(violates_delaunay_in_full(1.0, 1.0, 1.0, 1.0, 1.0, 53));
  EXPECT_TRUE(violates_delaunay_in_full(1.0, 0.6, 0.6, 0.6, 0.6, 53));
}

// Roundings of 2048 bits are no doubles: they must not be taken for violations.
TEST(DelaunayTest, ARoundingIsNoViolationWithAnyNumberOfBits) {
  using Number = BigFloat<64>;
  for (const int bits : {53, 128, 1024, 2048, 4096}) {
    const Number one(1.0, bits);
    const Number rounding = Number::power_of_two(1 - bits, bits);
    const Number half = Number(0.5, bits);
    const Number side = sqrt(half) * (one - rounding);
    EXPECT_FALSE(violates_delaunay_in_full(one, side, side, side, side, bits)) << bits;
    const Number beyond = sqrt(half) * (one - Number(64.0, bits) * rounding);
    EXPECT_TRUE(violates_delaunay_in_full(one, beyond, beyond, beyond, beyond, bits)) << bits;
  }
}

TEST(TriangleShape, HalfTangentsOfTheEgyptianTriangle) {
  // 3, 4, 5: the inner radius is 1, so tan of half the angles is 1 / (6 - side).
  const TriangleShape shape = shape_in_full(3.0, 4.0, 5.0, 53);
  EXPECT_NEAR(shape.half_tangent(0), 1.0 / 3.0, 1e-15);
  EXPECT_NEAR(shape.half_tangent(1), 1.0 / 2.0, 1e-15);
  EXPECT_NEAR(shape.half_tangent(2), 1.0, 1e-15);
  EXPECT_NEAR(half_tangent_square(3.0, 4.0, 5.0), 1.0 / 9.0, 1e-15);
}

TEST(TriangleShape, NeedlesKeepTheirSmallAngleWithMoreBits) {
  // Height 2^-40 over the middle of a base of length 2, sides sqrt(1 + 2^-80): the angles beside
  // the base are atan(2^-40), which doubles cannot tell from nothing.
  const int bits = 200;
  const double height = std::ldexp(1.0, -40);
  const BigFloat<4> square(height * height, bits);
  const BigFloat<4> side = sqrt(BigFloat<4>(1.0, bits) + square);
  const TriangleShape shape = shape_in_full(BigFloat<4>(2.0, bits), side, side, bits);
  const double expected = std::tan(0.5 * std::atan(height));
  EXPECT_NEAR(shape.half_tangent(1), expected, 1e-14 * expected);
  EXPECT_NEAR(shape.half_tangent(2), expected, 1e-14 * expected);
  EXPECT_FALSE(rounded_lengths_serve(shape_in_full(2.0, 1.0, 1.0, 53).x, 1e-3));
}

// 2^-2048 is no double.
TEST(TriangleShape, ABrokenTriangleInequalityReadsAsBarelyValidWithAnyNumberOfBits) {
  using Number = BigFloat<32>;
  const int bits = 2048;
  const TriangleShape shape =
      shape_in_full(Number(3.0, bits), Number(1.0, bits), Number(1.0, bits), bits);
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(shape.x[k], 0.0);
    EXPECT_TRUE(std::isfinite(shape.half_tangent(k)));
  }
  EXPECT_GT(shape.half_tangent(0), 1e7);
}

TEST(TriangleShape, RoundedLengthsServeWhereNoDifferenceIsSmall) {
  double x[3];
  perimeter_differences(1.0, 1.0, 1.0, x);
  for (const double difference : x) EXPECT_NEAR(difference, 1.0 / 3.0, 1e-15);
  EXPECT_TRUE(rounded_lengths_serve(x, 1e-14));
  EXPECT_FALSE(rounded_lengths_serve(x, 1e-16));
}

}  // namespace
}  // namespace flipfree::intrinsic::triangulation_test
