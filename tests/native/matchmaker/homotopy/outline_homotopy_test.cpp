#include "flipfree/matchmaker/homotopy/outline_homotopy.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "flipfree/matchmaker/target/sheet_target.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker::outline_homotopy_test {
namespace {

constexpr Index kSpokes = 40;

// A doodle after Milnor's: a closed curve, symmetric about the vertical axis, that bounds two
// different immersed disks, each the other's mirror image.
Polygon doodle() {
  const std::array<double, 5> a = {0.328, -0.398, 2.009, -0.521, 0.591};
  const std::array<double, 5> b = {-0.153, -0.810, -1.184, -0.280, -1.236};
  Polygon curve;
  for (Index i = 0; i < kSpokes; ++i) {
    const double t = 2 * std::numbers::pi * (i + 0.5) / kSpokes;
    Vector2 p = Vector2::Zero();
    for (std::size_t k = 0; k < 5; ++k) {
      const double frequency = static_cast<double>(k) + 1;
      p += Vector2(a[k] * std::sin(frequency * t), b[k] * std::cos(frequency * t));
    }
    curve.push_back(p);
  }
  return curve;
}

// A wheel: vertex 0 in the middle, the rim 1 .. kSpokes counter-clockwise.
mesh::Surface wheel() {
  mesh::Surface surface;
  surface.vertices = Points3::Zero(kSpokes + 1, 3);
  surface.faces.resize(kSpokes, 3);
  for (Index i = 0; i < kSpokes; ++i) {
    const double t = 2 * std::numbers::pi * i / kSpokes;
    surface.vertices.row(i + 1) << std::cos(t), std::sin(t), 0.0;
    surface.faces.row(i) << 0, i + 1, (i + 1) % kSpokes + 1;
  }
  return surface;
}

// The doodle's disk that contains the straight slit from boundary vertex `from` to (0, -1).
SheetTarget doodle_target(const mesh::Surface& surface, Index from) {
  MatchRequest request;
  request.boundary_uv = doodle();
  for (Index i = 0; i < kSpokes; ++i) request.boundary_loop.push_back(i + 1);
  request.points = {{0, {0.0, -1.0}}};
  request.paths = {{0, from + 1}};
  mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  ExecutionContext context;
  return sheet_target(refined, read_constraints(refined, request), context);
}

std::set<std::array<VertexId, 3>> triangles_of(const TargetDomain& domain, bool mirrored) {
  std::set<std::array<VertexId, 3>> result;
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (!mesh.alive(f)) continue;
    std::array<VertexId, 3> t = mesh.corners(f);
    for (VertexId& v : t) {
      v = domain.mesh_vertex[static_cast<std::size_t>(v)] - 1;
      if (mirrored) v = kSpokes - 1 - v;
    }
    std::sort(t.begin(), t.end());
    result.insert(t);
  }
  return result;
}

TEST(OutlineHomotopy, EveryFrameIsAnImmersedDiskFromAConvexPolygonToTheTarget) {
  const mesh::Surface surface = wheel();
  const SheetTarget target = doodle_target(surface, 4);
  const OutlineHomotopy homotopy(target.domain, target.pins);
  const mesh::EditableTriangulation& mesh = homotopy.domain().triangulation;
  const auto at = [](const std::vector<Vector2>& p, Index v) {
    return p[static_cast<std::size_t>(v)];
  };
  for (int i = 0; i <= 64; ++i) {
    const std::vector<Vector2> corners = homotopy.corners(i / 64.0);
    for (FaceId f = 0; f < mesh.face_slots(); ++f) {
      if (!mesh.alive(f)) continue;
      const auto t = mesh.corners(f);
      EXPECT_GT(numeric::orientation(at(corners, t[0]), at(corners, t[1]), at(corners, t[2])), 0);
    }
  }
  const std::vector<Vector2> first = homotopy.corners(0.0);
  const std::vector<Index>& outline = homotopy.domain().outline;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    EXPECT_GT(
        numeric::orientation(at(first, outline[i]), at(first, outline[(i + 1) % outline.size()]),
                             at(first, outline[(i + 2) % outline.size()])),
        0);
  }
  EXPECT_EQ(homotopy.corners(1.0), homotopy.domain().point);
  const auto places = homotopy.places(1.0, homotopy.corners(1.0));
  EXPECT_EQ(places.back(), std::pair(VertexId{0}, Vector2(0.0, -1.0)));
  // Frames change continuously up to both ends.
  for (const double t : {0.0, 1.0}) {
    const std::vector<Vector2> near = homotopy.corners(t == 0 ? 1e-9 : 1 - 1e-9);
    const std::vector<Vector2> end = homotopy.corners(t);
    for (const Index v : outline) EXPECT_LT((at(near, v) - at(end, v)).norm(), 1e-5);
  }
}

TEST(OutlineHomotopy, PathsChooseBetweenTheTwoDisksOfADoodle) {
  const mesh::Surface surface = wheel();
  const SheetTarget one = doodle_target(surface, 4);
  const SheetTarget other = doodle_target(surface, kSpokes - 1 - 4);
  // The Delaunay triangulation of an immersed disk is its own up to cocircular corners, which the
  // doodle's mirror pairs are: so shares are compared, with the mirror image and with itself.
  EXPECT_NE(triangles_of(one.domain, false), triangles_of(other.domain, false));
  std::size_t common = 0;
  const auto mirrored = triangles_of(other.domain, true);
  for (const auto& t : triangles_of(one.domain, false)) common += mirrored.count(t);
  EXPECT_GT(common, mirrored.size() / 2);
  std::size_t same = 0;
  const auto plain = triangles_of(other.domain, false);
  for (const auto& t : triangles_of(one.domain, false)) same += plain.count(t);
  EXPECT_LT(same, plain.size() / 2);
}

}  // namespace
}  // namespace flipfree::matchmaker::outline_homotopy_test
