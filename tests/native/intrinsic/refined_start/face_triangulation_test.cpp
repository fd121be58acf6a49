#include "flipfree/intrinsic/refined_start/face_triangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "flipfree/numeric/predicates.h"

namespace flipfree::intrinsic::face_triangulation_test {
namespace {

// A needle with corners at (0,0), (1,0), (0.9, 0.001).
FaceTriangulation::Point point(double b, double c) {
  const double scale = std::ldexp(1.0, 52);
  const Vector2 affine(std::nearbyint(b * scale) / scale, std::nearbyint(c * scale) / scale);
  return {affine, affine.x() * Vector2(1.0, 0.0) + affine.y() * Vector2(0.9, 0.001)};
}

TEST(FaceTriangulation, IsPositiveAndCompleteWithPointsInsideAndOnSides) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  FaceTriangulation t;
  t.start({point(0, 0), point(1, 0), point(0, 1)});
  for (int i = 0; i < 60; ++i) {
    const double s = point(unit(random), 0).affine.x();
    t.insert(point(s, 0));
    t.insert(point(0, s));
    t.insert(point(1 - s, s));
    double b = unit(random), c = unit(random);
    if (b + c >= 1) b = 1 - b, c = 1 - c;
    t.insert(point(b, c));
  }
  double area = 0;
  Index sides = 0;
  for (Index f = 0; f < t.triangle_count(); ++f) {
    const auto at = [&](Index k) { return t.point(t.vertex(3 * f + k)).affine; };
    ASSERT_GT(numeric::orientation(at(0), at(1), at(2)), 0) << f;
    area += (at(1) - at(0)).x() * (at(2) - at(0)).y() - (at(1) - at(0)).y() * (at(2) - at(0)).x();
    for (Index h = 3 * f; h < 3 * f + 3; ++h) {
      const Index o = t.opposite(h);
      if (o == kInvalid) {
        ++sides;
        continue;
      }
      EXPECT_EQ(t.opposite(o), h);
      EXPECT_EQ(t.vertex(h), t.vertex(next_corner(o)));
    }
  }
  EXPECT_NEAR(area, 1.0, 1e-12);
  EXPECT_EQ(sides, 3 + 3 * 60);
  // Euler: triangles = 2 inner + sides - 2.
  EXPECT_EQ(t.triangle_count(), 2 * 60 + sides - 2);
}

TEST(FaceTriangulation, KnowsAPointThatItHasAlready) {
  FaceTriangulation t;
  t.start({point(0, 0), point(1, 0), point(0, 1)});
  EXPECT_EQ(t.insert(point(0.25, 0.25)), 3);
  EXPECT_EQ(t.insert(point(0.25, 0.25)), 3);
  EXPECT_EQ(t.insert(point(1, 0)), 1);
  EXPECT_EQ(t.triangle_count(), 3);
}

}  // namespace
}  // namespace flipfree::intrinsic::face_triangulation_test
