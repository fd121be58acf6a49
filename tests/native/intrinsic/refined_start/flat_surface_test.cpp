#include "flipfree/intrinsic/refined_start/flat_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "intrinsic/refined_start/flat_surfaces.h"

namespace flipfree::intrinsic::flat_surface_test {
namespace {

constexpr double kPi = std::numbers::pi;

Vector3 in_space(const mesh::Surface& s, const FlatSurface& f, const FacePoint& p) {
  const Vector3 w = f.weights(p);
  return w[0] * s.vertices.row(s.faces(p.face, 0)).transpose() +
         w[1] * s.vertices.row(s.faces(p.face, 1)).transpose() +
         w[2] * s.vertices.row(s.faces(p.face, 2)).transpose();
}

TEST(FlatSurface, LinesInThePlaneAreStraight) {
  const mesh::Surface s = test::grid(10, 10);
  const FlatSurface f = test::flat(s);
  VertexId middle = kInvalid;
  const Vector3 centre = s.vertices.colwise().mean().transpose();
  for (VertexId v = 0; v < f.vertex_count; ++v) {
    if ((s.vertices.row(v).transpose() - centre).norm() < 1e-9) middle = v;
  }
  ASSERT_NE(middle, kInvalid);
  const HalfedgeId first =
      f.fan[static_cast<std::size_t>(f.fan_begin[static_cast<std::size_t>(middle)])];
  const Vector3 side =
      (s.vertices.row(mesh::target(s.faces, first)) - s.vertices.row(middle)).transpose();
  const double zero = std::atan2(side.y(), side.x());
  const double size = (s.vertices.colwise().maxCoeff() - s.vertices.colwise().minCoeff())[0];
  for (int i = 0; i < 40; ++i) {
    const double angle = 0.1 + 0.37 * i;
    FaceRay ray = ray_from_vertex(f, middle, angle);
    ASSERT_TRUE(follow_ray(f, ray, 0.41 * size));
    const Vector3 expected =
        centre + 0.41 * size * Vector3(std::cos(angle + zero), std::sin(angle + zero), 0);
    EXPECT_LT((in_space(s, f, ray) - expected).norm(), 1e-9 * size) << i;
  }
}

TEST(FlatSurface, LinesEndAtTheBoundary) {
  const mesh::Surface s = test::grid(4, 4);
  const FlatSurface f = test::flat(s);
  FaceRay ray;
  ray.face = 0;
  ray.at = (f.corner_at(0) + f.corner_at(1) + f.corner_at(2)) / 3.0;
  EXPECT_FALSE(follow_ray(f, ray, 1000.0));
}

TEST(FlatSurface, ALineAroundATetrahedronComesBack) {
  // Parallel to an edge, at mid height: a closed geodesic of four pieces, half an edge each.
  const mesh::Surface s = test::tetrahedron();
  const FlatSurface f = test::flat(s);
  const double l = f.length[0];
  FaceRay ray;
  ray.face = 0;
  ray.at = 0.5 * (f.corner_at(2) + f.corner_at(0));
  ray.direction = Vector2::UnitX();
  const Vector3 start = in_space(s, f, ray);
  ASSERT_TRUE(follow_ray(f, ray, 2 * l - 1e-9));
  EXPECT_LT((in_space(s, f, ray) - start).norm(), 1e-8 * l);
  for (VertexId v = 0; v < 4; ++v) {
    EXPECT_NEAR(f.total_angle[static_cast<std::size_t>(v)], kPi, 1e-12);
  }
}

TEST(FlatSurface, NeedlesKeepTheirHeight) {
  EXPECT_EQ(apex_of(1.0, 0.6, 0.6).x(), 0.5);
  const Vector2 thin = apex_of(1e-6, 1.0, 1.0);
  EXPECT_NEAR(thin.y(), 1.0, 1e-12);
  EXPECT_NEAR(apex_of(1.0, 1.0, 1e-6).y(), 1e-6, 1e-18);
}

}  // namespace
}  // namespace flipfree::intrinsic::flat_surface_test
