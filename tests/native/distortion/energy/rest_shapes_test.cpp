#include "flipfree/distortion/energy/rest_shapes.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numeric>

#include "support/shapes.h"

namespace flipfree::distortion::rest_shapes_test {
namespace {

// Rest edges from corner 0, as columns.
Eigen::Matrix2d edges(const RestTriangle& rest) {
  Eigen::Matrix2d gradient;
  gradient << rest.gradient[0][0], rest.gradient[0][1], rest.gradient[1][0], rest.gradient[1][1];
  return gradient.inverse();
}

TEST(RestShapes, are_the_surfaces_triangles_in_a_unit_in_which_its_area_is_one) {
  for (const double unit : {1e-100, 1.0, 1e100}) {
    mesh::Surface surface = test::bumpy_grid(7, 5, 0.5, 2.0);
    surface.vertices *= unit;
    const RestShapes shapes = build_rest_shapes(surface, ExecutionContext());
    double area = 0.0, weights = 0.0;
    for (FaceId f = 0; f < surface.faces.rows(); ++f) {
      const RestTriangle& rest = shapes.triangles[static_cast<std::size_t>(f)];
      const Eigen::Matrix2d flat = edges(rest);
      const auto at = [&](Index k) -> Vector3 { return surface.vertices.row(surface.faces(f, k)); };
      const Vector3 e1 = (at(1) - at(0)) / shapes.length;
      const Vector3 e2 = (at(2) - at(0)) / shapes.length;
      EXPECT_NEAR(flat.col(0).norm(), e1.norm(), 1e-12);
      EXPECT_NEAR(flat.col(1).norm(), e2.norm(), 1e-12);
      EXPECT_NEAR(flat.col(0).dot(flat.col(1)), e1.dot(e2), 1e-12);
      EXPECT_GT(flat.determinant(), 0.0);
      EXPECT_NEAR(rest.determinant * flat.determinant(), 1.0, 1e-11);
      EXPECT_NEAR(rest.weight, 0.5 * flat.determinant(), 1e-12);
      area += 0.5 * flat.determinant();
      weights += rest.weight;
    }
    EXPECT_NEAR(area, 1.0, 1e-11);
    EXPECT_NEAR(weights, 1.0, 1e-12);
  }
}

TEST(RestShapes, needles_are_raised_and_faces_without_area_keep_a_say) {
  mesh::Surface surface = test::grid(4, 4);
  // Corner 1 of face 0 goes to the middle between the others: no area, on a longest edge.
  const auto corner = [&](Index k) { return surface.vertices.row(surface.faces(0, k)); };
  surface.vertices.row(surface.faces(0, 1)) = (0.5 * (corner(0) + corner(2))).eval();
  const RestShapes shapes = build_rest_shapes(surface, ExecutionContext());
  const RestTriangle& raised = shapes.triangles[0];
  const Eigen::Matrix2d flat = edges(raised);
  const double longest = flat.col(1).norm();
  EXPECT_NEAR(flat.determinant() / (longest * longest), kFlattestRest, 1e-9 * kFlattestRest);
  double sum = 0.0;
  for (const RestTriangle& rest : shapes.triangles) {
    EXPECT_GE(rest.weight, 0.99 * kLeastWeight / 32);
    sum += rest.weight;
  }
  EXPECT_NEAR(raised.weight, kLeastWeight / 32, 0.01 * kLeastWeight / 32);
  EXPECT_NEAR(sum, 1.0, 1e-12);
}

}  // namespace
}  // namespace flipfree::distortion::rest_shapes_test
