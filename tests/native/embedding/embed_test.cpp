#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/embedding/disk.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/embedding/embed_surface.h"
#include "flipfree/embedding/star.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/predicates.h"
#include "fuzz/rational.h"
#include "support/shapes.h"

namespace flipfree::embedding::embed_test {
namespace {

struct Disk {
  mesh::Surface surface;
  std::vector<VertexId> loop;
  Points2 boundary;
  Index vertex_count() const { return static_cast<Index>(surface.vertices.rows()); }
};

Disk make_disk(mesh::Surface surface, embedding::BoundaryShape shape) {
  Disk disk;
  disk.surface = std::move(surface);
  const mesh::Adjacency& adjacency = disk.surface.adjacency();
  disk.loop = mesh::boundary_loops(disk.surface.faces, adjacency).front();
  const std::vector<double> lengths(disk.loop.size(), 1.0);
  disk.boundary = embedding::place_boundary(shape, lengths);
  return disk;
}

// Closed surface without its last face, onto the triangle.
Disk opened(mesh::Surface surface) {
  surface.faces = Triangles(surface.faces.triangles().topRows(surface.faces.rows() - 1));
  return make_disk(std::move(surface), embedding::BoundaryShape::kTriangle);
}

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

Embedding embed(const Disk& disk, const EmbedOptions& options) {
  ExecutionContext context;
  return embed_disk_refined({disk.surface.faces, disk.vertex_count(), disk.loop, disk.boundary},
                            options, context);
}

void expect_flip_free(const Embedding& e) {
  ExecutionContext context;
  EXPECT_TRUE(distortion::is_flip_free(e.faces, e.uv, context));
  EXPECT_TRUE(distortion::is_flip_free(e.faces, as_stored(e.uv), context));
}

TEST(Embed, EveryOuterFaceOfASphereWorks) {
  const mesh::Surface sphere = test::sphere(14, 9);
  for (FaceId f = 0; f < sphere.faces.rows(); ++f) {
    mesh::Surface open = sphere;
    Triangles faces = sphere.faces;
    faces.row(f).swap(faces.row(faces.rows() - 1));
    open.faces = std::move(faces);
    expect_flip_free(embed(opened(open), {}));
  }
}

// Thesis 3.5, Figure 3.13: the polygon's rows hold no number.
TEST(Embed, APolygonWithoutRoomIsInfeasibleByExactDecision) {
  Triangles fan(3, 3);
  fan << 0, 1, 3, 1, 2, 3, 2, 0, 3;
  const auto run = [&](const Points2& p, bool float32) {
    ExecutionContext context;
    EmbedOptions options;
    options.float32 = float32;
    const Points2 uv = embed_disk({fan, 4, {0, 1, 2}, p}, options, context).uv;
    EXPECT_TRUE(distortion::is_flip_free(fan, uv, context));
  };
  Points2 flat(3, 2);
  flat << -0.5, 1, 0.5, 1, 0, 1 + 0x1p-52;
  EXPECT_THROW(run(flat, false), Infeasible);
  flat(2, 1) = 1 + 0x1p-51;  // one row inside
  EXPECT_NO_THROW(run(flat, false));
  EXPECT_THROW(run(flat, true), Infeasible);
  flat(2, 1) = 1 + 0x1p-23;
  EXPECT_THROW(run(flat, true), Infeasible);
  EXPECT_NO_THROW(run(flat, false));
  flat(2, 1) = 1 + 0x1p-22;
  EXPECT_NO_THROW(run(flat, true));
  try {
    flat(2, 1) = 1 + 0x1p-23;
    run(flat, true);
  } catch (const Infeasible& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kNoRoomInPolygon);
  }
}

TEST(Embed, ScaleAndPlaceOfThePolygonDecideNothingButRoom) {
  const auto disk = make_disk(test::tube(8, 100), BoundaryShape::kCircle);
  ExecutionContext context;
  for (const double scale : {1e-30, 1e-4, 1.0, 1e5, 1e30}) {
    Disk scaled = disk;
    scaled.boundary *= scale;
    expect_flip_free(embed(scaled, {}));
  }
  // Far away, 32-bit floats hold too few points: said so, and 64 bits still work.
  Disk far = disk;
  far.boundary.col(0).array() += 1e9;
  EXPECT_THROW(embed(far, {}), Infeasible);
  EmbedOptions options;
  options.float32 = false;
  const Embedding e = embed(far, options);
  EXPECT_TRUE(distortion::is_flip_free(e.faces, e.uv, context));
}

// Strips without inner vertices: the circle has room for all their edges, evenly spaced points do
// not, and the cure that is named works.
TEST(EmbedSurface, long_strips_are_embedded_without_new_vertices) {
  for (const Index length : {1000, 100000}) {
    const mesh::Surface strip = test::grid(length, 1);
    EmbedSurfaceOptions options;
    ExecutionContext context;
    const certify::Parametrization map = embed_surface(strip, options, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(map.surface.vertices.rows(), strip.vertices.rows());
    if (length < 100000) continue;
    options.loop = make_disk(strip, BoundaryShape::kCircle).loop;
    options.polygon = spread_on_circle(std::vector<double>(options.loop.size(), 1.0));
    try {
      embed_surface(strip, options, context);
      FAIL() << "a map was found";
    } catch (const NotConverged& e) {
      EXPECT_NE(e.error().message.find("Take the circle as the boundary"), std::string::npos);
      EXPECT_EQ(e.error().kind, ElementKind::kEdge);
    }
  }
}

// A fan of n triangles around vertex n, its ring at the given places.
struct Ring {
  PlanarMap map;
  Star star;
};
Ring ring_of(const Points2& places) {
  const auto n = static_cast<Index>(places.rows());
  Triangles faces(n, 3);
  std::vector<VertexId> loop;
  for (Index i = 0; i < n; ++i) {
    faces.row(i) << i, (i + 1) % n, n;
    loop.push_back(i);
  }
  Points2 uv(n + 1, 2);
  uv << places, places.row(0);
  Ring ring{make_planar_map(faces, loop, uv, true), {}};
  gather_star(ring.map, ring.map.mesh.outgoing(n), ring.star);
  return ring;
}

// Rings a few floats wide, of any shape: every float in their box is tried.
TEST(FindRoom, counts_the_floats_that_see_the_whole_ring) {
  std::mt19937 random(1);
  const double step = std::ldexp(1.0, -23);  // of the floats in [1, 2)
  int with_room = 0, without = 0;
  for (int i = 0; i < 400; ++i) {
    const Index n = 3 + static_cast<Index>(random() % 4);
    Points2 places(n, 2);
    for (Index k = 0; k < n; ++k) {
      const double angle =
          2 * std::numbers::pi * (k + 0.5 * static_cast<double>(random() % 100) / 100) / n;
      const double radius = 1 + static_cast<double>(random() % 6);
      const double flat = i % 2 == 0 ? 1.0 : 0.2;  // every other one a needle
      places.row(k) << 1.25 + step * std::round(radius * std::cos(angle)),
          1.5 + step * std::round(flat * radius * std::sin(angle));
    }
    const Ring ring = ring_of(places);
    std::uint64_t expected = 0;
    for (int x = -8; x <= 8; ++x) {
      for (int y = -8; y <= 8; ++y) {
        const fuzz::Point p = fuzz::exact(Vector2(1.25 + x * step, 1.5 + y * step));
        bool inside = true;
        for (Index k = 0; k < n; ++k) {
          inside = inside && fuzz::side(fuzz::exact(places.row(k).transpose()),
                                        fuzz::exact(places.row((k + 1) % n).transpose()), p) > 0;
        }
        expected += inside;
      }
    }
    const Room room = find_room(ring.map, ring.star);
    EXPECT_TRUE(room.exact);
    EXPECT_EQ(room.points, expected);
    (expected > 0 ? with_room : without)++;
    if (expected > 0) {
      EXPECT_TRUE(star_positive(ring.map, ring.star, room.middle));
      EXPECT_EQ(ring.map.snap(room.middle), room.middle);
    }
  }
  EXPECT_GT(with_room, 50);
  EXPECT_GT(without, 50);
}

}  // namespace
}  // namespace flipfree::embedding::embed_test
