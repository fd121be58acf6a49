#include "flipfree/intrinsic/layout/polygon_triangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/base/plane.h"

namespace flipfree::intrinsic::polygon_triangulation_test {
namespace {

// A triangle (0,0), (1,0), (0,1) with `count` points on its first side; uv as given by `place(t)`
// for those.
template <typename Place>
std::vector<PolygonVertex> side_polygon(Index count, const Place& place) {
  std::vector<PolygonVertex> polygon;
  const auto add = [&](std::uint8_t sides, double x, double y, const Vector2& uv) {
    PolygonVertex v;
    v.id = static_cast<Index>(polygon.size());
    v.sides = sides;
    v.domain = {x, y};
    v.uv = uv;
    v.stored = as_stored(uv);
    polygon.push_back(v);
  };
  add(0b101, 0, 0, {0, 0});
  for (Index i = 1; i <= count; ++i) {
    const double t = static_cast<double>(i) / (count + 1);
    add(0b001, t, 0, place(t));
  }
  add(0b011, 1, 0, {1, 0});
  add(0b110, 0, 1, {0, 1});
  return polygon;
}

double total_area(const std::vector<PolygonVertex>& p,
                  const std::vector<PolygonTriangle>& triangles) {
  double area = 0;
  for (const PolygonTriangle& t : triangles) {
    const auto &a = p[static_cast<std::size_t>(t[0])].domain,
               &b = p[static_cast<std::size_t>(t[1])].domain,
               &c = p[static_cast<std::size_t>(t[2])].domain;
    area += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
  }
  return area;
}

TEST(PolygonTriangulation, NeverUsesATriangleWithinOneSide) {
  // The image of the side bulges outward, so triangles along it would be positive in UV, but flat
  // in the input.
  for (const Index count : {1, 5, 20, 80}) {
    const auto polygon = side_polygon(count, [](double t) { return Vector2{t, t * (t - 1)}; });
    std::vector<PolygonTriangle> triangles;
    ASSERT_TRUE(triangulate_polygon(polygon, {}, Storage::k64And32, triangles, ExecutionContext()))
        << count;
    EXPECT_EQ(triangles.size(), polygon.size() - 2);
    EXPECT_NEAR(total_area(polygon, triangles), 0.5, 1e-12);
    for (const PolygonTriangle& t : triangles) {
      EXPECT_TRUE(valid_triangle(polygon[static_cast<std::size_t>(t[0])],
                                 polygon[static_cast<std::size_t>(t[1])],
                                 polygon[static_cast<std::size_t>(t[2])], Storage::k64And32));
    }
  }
}

TEST(PolygonTriangulation, DecidesOnTheStoredValues) {
  // Positive in 64 bits by less than the spacing of 32-bit numbers.
  auto polygon = side_polygon(0, [](double) { return Vector2{0, 0}; });
  const double shift = 1.0 + 1e-12;
  polygon[0].uv = {1.0, 1.0};
  polygon[1].uv = {2.0, 2.0};
  polygon[2].uv = {1.5, 1.5 * shift};
  for (PolygonVertex& v : polygon) v.stored = as_stored(v.uv);
  std::vector<PolygonTriangle> triangles;
  EXPECT_TRUE(triangulate_polygon(polygon, {}, Storage::k64Only, triangles, ExecutionContext()));
  EXPECT_FALSE(triangulate_polygon(polygon, {}, Storage::k64And32, triangles, ExecutionContext()));
}

// A corner of 2 pi + 0.6 in the plane: the three corners of the input triangle alone form a
// positive triangle too, but one that winds around its corner once too little.
TEST(PolygonTriangulation, AnglesTellAWideCornerFromANarrowOne) {
  const double wide = 2 * std::numbers::pi + 0.6;
  std::vector<PolygonVertex> polygon;
  const auto add = [&](std::uint8_t sides, double x, double y, double u, double v) {
    PolygonVertex vertex;
    vertex.id = static_cast<Index>(polygon.size());
    vertex.sides = sides;
    vertex.domain = {x, y};
    vertex.uv = {u, v};
    vertex.stored = as_stored(vertex.uv);
    polygon.push_back(vertex);
  };
  // Corner 0 in the origin; side 1, from corner 1 to corner 2, runs around it by `wide`.
  add(0b101, 0, 0, 0, 0);
  const Index count = 8;
  for (Index i = 0; i <= count; ++i) {
    const double t = static_cast<double>(i) / count;
    const auto sides = static_cast<std::uint8_t>(i == 0 ? 0b011 : i == count ? 0b110 : 0b010);
    add(sides, 1 - t, t, std::cos(wide * t), std::sin(wide * t));
  }
  std::vector<double> angles(polygon.size(), std::numbers::pi - wide / count);
  angles[0] = wide;
  angles[1] = angles[count + 1] = std::numbers::pi / 2 - wide / (2 * count);
  std::vector<PolygonTriangle> triangles;
  ASSERT_TRUE(
      triangulate_polygon(polygon, angles, Storage::k64And32, triangles, ExecutionContext()));
  EXPECT_EQ(triangles.size(), static_cast<std::size_t>(count));
  for (const PolygonTriangle& t : triangles)
    EXPECT_TRUE(t[0] == 0 || t[1] == 0 || t[2] == 0);  // a fan

  const std::vector<PolygonVertex> whole{polygon[0], polygon[1], polygon[count + 1]};
  EXPECT_TRUE(triangulate_polygon(whole, {}, Storage::k64And32, triangles, ExecutionContext()));
  EXPECT_FALSE(triangulate_polygon(whole,
                                   {wide, (std::numbers::pi - 0.6) / 2 - std::numbers::pi,
                                    (std::numbers::pi - 0.6) / 2 - std::numbers::pi},
                                   Storage::k64And32, triangles, ExecutionContext()));
}

}  // namespace
}  // namespace flipfree::intrinsic::polygon_triangulation_test
