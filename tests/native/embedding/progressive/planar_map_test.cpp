#include "flipfree/embedding/progressive/planar_map.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>

#include "embedding/disks.h"
#include "flipfree/base/stored.h"
#include "flipfree/embedding/tutte/tutte.h"

namespace flipfree::embedding::planar_map_test {
namespace {

TEST(PlanarMap, energy_is_that_of_the_map_from_an_equilateral_triangle_of_the_target_area) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  int positive = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector2 a(unit(random), unit(random)), b(unit(random), unit(random)),
        c(unit(random), unit(random));
    const double area = 0.1 + std::abs(unit(random));
    Eigen::Matrix2d image, rest;
    image << b - a, c - a;
    const double energy = triangle_energy(a, b, c, area);
    if (image.determinant() <= 0) {
      EXPECT_EQ(energy, HUGE_VAL);
      continue;
    }
    ++positive;
    const double side = std::sqrt(4 * area / std::sqrt(3.0));
    rest << side, side / 2, 0, side * std::sqrt(3.0) / 2;
    const Eigen::Matrix2d j = image * rest.inverse();
    EXPECT_NEAR(energy / (j.squaredNorm() + j.inverse().squaredNorm()), 1.0, 1e-10);
  }
  EXPECT_GT(positive, 100);
}

TEST(PlanarMap, inner_vertices_are_on_the_grid_and_boundary_ones_where_they_were_given) {
  test::Disk disk = test::make_disk(test::grid(6, 5), BoundaryShape::kSquare);
  Points2 uv = disk.surface.vertices.leftCols<2>().array() * 0.3 + 0.123456789;
  for (const bool float32 : {false, true}) {
    const PlanarMap map = make_planar_map(disk.surface.faces, disk.loop, uv, float32);
    for (VertexId v = 0; v < uv.rows(); ++v) {
      const bool inner = !map.mesh.is_boundary(v);
      const Vector2 given = uv.row(v), rounded = given.cast<float>().cast<double>();
      EXPECT_EQ(map.at(v), inner && float32 ? rounded : given);
      if (!float32) continue;
      ASSERT_EQ(map.stored.rows(), uv.rows());
      EXPECT_EQ(Vector2(map.stored.row(v)), rounded);
    }
    EXPECT_NEAR(map.unit * static_cast<double>(map.share.size()), 0.09, 1e-12)
        << "the polygon's area";
    for (const double share : map.share) EXPECT_EQ(share, 1.0);
  }
  // A boundary of floats needs no second copy.
  EXPECT_EQ(make_planar_map(disk.surface.faces, disk.loop, as_stored(uv), true).stored.rows(), 0);
}

TEST(PlanarMap, faces_are_positive_only_if_they_are_as_given_and_as_stored) {
  Triangles faces(1, 3);
  faces << 0, 1, 2;
  const std::vector<VertexId> loop = {0, 1, 2};
  Points2 uv(3, 2);
  uv << 0, 0, 1, 1, 0.5 - 1e-12, 0.5 + 1e-12;
  EXPECT_FALSE(make_planar_map(faces, loop, uv, true).positive(0)) << "rounding flattens it";
  EXPECT_TRUE(make_planar_map(faces, loop, uv, false).positive(0));
  EXPECT_TRUE(is_valid_face(make_planar_map(faces, loop, uv, false), 0));
  uv.row(2) << 0.5, 0.5;
  EXPECT_FALSE(make_planar_map(faces, loop, uv, false).positive(0));
}

TEST(PolygonArea, has_the_sign_of_the_turn) {
  Points2 square(4, 2);
  square << 1, 1, 3, 1, 3, 4, 1, 4;
  EXPECT_DOUBLE_EQ(polygon_area(square), 6.0);
  EXPECT_DOUBLE_EQ(polygon_area(square.colwise().reverse()), -6.0);
  Points2 circle(1000, 2);
  for (Index i = 0; i < 1000; ++i) {
    const double angle = 2 * std::numbers::pi * i / 1000;
    circle.row(i) << 5 + std::cos(angle), std::sin(angle) - 7;
  }
  EXPECT_NEAR(polygon_area(circle), std::numbers::pi, 1e-4);
}

}  // namespace
}  // namespace flipfree::embedding::planar_map_test
