#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/intrinsic/layout/polygon_triangulation.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic::overlay_test {
namespace {

// The surface's faces, with every boundary edge joined to one new vertex (the last).
FlipMesh closed_mesh(const mesh::Surface& surface) {
  const auto n = static_cast<Index>(surface.vertices.rows());
  const mesh::Adjacency& adjacency = surface.adjacency();
  std::vector<std::array<Index, 3>> faces;
  for (Index f = 0; f < surface.faces.rows(); ++f) {
    faces.push_back({surface.faces(f, 0), surface.faces(f, 1), surface.faces(f, 2)});
  }
  for (HalfedgeId h = 0; h < 3 * static_cast<Index>(surface.faces.rows()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    faces.push_back({mesh::target(surface.faces, h), mesh::source(surface.faces, h), n});
  }
  FlipMesh mesh;
  std::map<std::pair<Index, Index>, HalfedgeId> ids;
  mesh.next.resize(faces.size() * 3);
  mesh.origin.resize(faces.size() * 3);
  Index edges = 0;
  for (const auto& f : faces) {
    std::array<HalfedgeId, 3> h{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = f[k], b = f[(k + 1) % 3];
      if (!ids.count({a, b})) {
        ids[{a, b}] = 2 * edges;
        ids[{b, a}] = 2 * edges + 1;
        ++edges;
      }
      h[k] = ids[{a, b}];
      mesh.origin[static_cast<std::size_t>(h[k])] = a;
    }
    for (std::size_t k = 0; k < 3; ++k) mesh.next[static_cast<std::size_t>(h[k])] = h[(k + 1) % 3];
  }
  return mesh;
}

// Positions of crossings against chords of one circle, where Penner lengths are Euclidean lengths
// and hyperbolic lines are straight.
// A fan over n points of the unit circle, closed by an apex; edges of the disk may be flipped.
struct InscribedPolygon {
  std::vector<Vector2> points;
  OverlayCoordinates coordinates;
  Index apex;
};

InscribedPolygon inscribed_polygon(Index n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> jitter(-0.4, 0.4);
  std::vector<Vector2> points;
  mesh::Surface fan;
  fan.vertices.resize(n, 3);
  Triangles faces(n - 2, 3);
  for (Index i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * (i + jitter(random)) / n;
    points.emplace_back(std::cos(a), std::sin(a));
    fan.vertices.row(i) << points.back().x(), points.back().y(), 0.0;
  }
  for (Index i = 0; i + 2 < n; ++i) faces.row(i) << 0, i + 1, i + 2;
  fan.faces = std::move(faces);
  OverlayCoordinates coordinates(closed_mesh(fan));
  for (int k = 0; k < 60 * n; ++k) {
    const auto h = static_cast<HalfedgeId>(
        random() % static_cast<unsigned>(coordinates.current().halfedge_count()));
    const FlipMesh& mesh = coordinates.current();
    const auto touches = [&](HalfedgeId g) {
      return mesh.origin_of(g) == n || mesh.origin_of(g ^ 1) == n ||
             mesh.origin_of(mesh.previous(g)) == n || mesh.origin_of(mesh.previous(g ^ 1)) == n;
    };
    if (!touches(h)) coordinates.flip(h);
  }
  return {points, std::move(coordinates), n};
}

TEST(OverlayPositions, ChordsOfOneCircleCrossWhereTheyCross) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Index n = 24;
    const InscribedPolygon polygon = inscribed_polygon(n, seed);
    const FlipMesh& mesh = polygon.coordinates.current();
    std::mt19937 random(seed + 100);
    std::uniform_real_distribution<double> scale_of(-3.0, 3.0);
    std::vector<long double> u(at(n) + 1);
    for (auto& x : u) x = scale_of(random);
    std::vector<long double> lengths(mesh.edge_count(), 1.0L);
    for (EdgeId e = 0; at(e) < mesh.edge_count(); ++e) {
      const Index a = mesh.origin_of(2 * e), b = mesh.origin_of(2 * e + 1);
      if (a < n && b < n) {
        lengths[at(e)] =
            static_cast<long double>((polygon.points[at(a)] - polygon.points[at(b)]).norm()) *
            std::exp((u[at(a)] + u[at(b)]) / 2);
      }
    }
    std::vector<HalfedgeId> curves;
    for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); h += 2) {
      if (polygon.coordinates.input().origin_of(h) < n &&
          polygon.coordinates.input().origin_of(h ^ 1) < n) {
        curves.push_back(h);
      }
    }
    const ExecutionContext context;
    OverlayTrace trace = trace_overlay(polygon.coordinates, curves, 1'000'000, context);
    locate_crossings(polygon.coordinates, lengths, u, trace, context);
    ASSERT_GT(trace.crossings.size(), 20u);
    for (std::size_t c = 0; c < curves.size(); ++c) {
      const Vector2 a = polygon.points[at(polygon.coordinates.input().origin_of(curves[c]))];
      const Vector2 d =
          polygon.points[at(polygon.coordinates.input().origin_of(curves[c] ^ 1))] - a;
      for (const Crossing& crossing : trace.of_curve(c)) {
        const HalfedgeId h = crossing.through;
        const Index s = mesh.origin_of(h), t = mesh.origin_of(h ^ 1);
        const Vector2 p = polygon.points[at(s)], e = polygon.points[at(t)] - p;
        const double cross = d.x() * e.y() - d.y() * e.x();
        const double along_curve = ((p - a).x() * e.y() - (p - a).y() * e.x()) / cross;
        const double along_edge = ((p - a).x() * d.y() - (p - a).y() * d.x()) / cross;
        // The input's metric is the circle's; the final one weights end points by exp(-u).
        EXPECT_NEAR(crossing.on_curve.target, along_curve, 1e-12);
        const double ws = (1 - along_edge) * std::exp(static_cast<double>(-u[at(s)]));
        const double wt = along_edge * std::exp(static_cast<double>(-u[at(t)]));
        EXPECT_NEAR(crossing.on_edge.target, wt / (ws + wt), 1e-12);
        EXPECT_NEAR(crossing.on_edge.source + crossing.on_edge.target, 1.0, 1e-15);
      }
    }
  }
}

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
}  // namespace flipfree::intrinsic::overlay_test
