#include "flipfree/intrinsic/refined_start/signpost_triangulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "intrinsic/refined_start/flat_surfaces.h"

namespace flipfree::intrinsic::signpost_triangulation_test {
namespace {

// Circumference of all angles around vertices, by the lengths of the triangulation.
std::vector<double> angle_sums(const SignpostTriangulation& t) {
  std::vector<double> sum(t.vertices().size(), 0.0);
  for (FaceId f = 0; f < t.face_count(); ++f) {
    HalfedgeId h = t.face_halfedge(f);
    for (int k = 0; k < 3; ++k, h = t.next(h)) {
      const double a = t.length(h), b = t.length(t.next(t.next(h))), c = t.length(t.next(h));
      sum[static_cast<std::size_t>(t.origin(h))] +=
          std::acos(std::clamp((a * a + b * b - c * c) / (2 * a * b), -1.0, 1.0));
    }
  }
  return sum;
}

// Both angles opposite of every inner edge together at most pi.
void expect_delaunay(const SignpostTriangulation& t) {
  const auto opposite = [&](HalfedgeId h) {
    const double c = t.length(h), a = t.length(t.next(h)), b = t.length(t.next(t.next(h)));
    return std::acos(std::clamp((a * a + b * b - c * c) / (2 * a * b), -1.0, 1.0));
  };
  for (EdgeId e = 0; e < t.edge_count(); ++e) {
    if (t.on_boundary(2 * e)) continue;
    EXPECT_LE(opposite(2 * e) + opposite(2 * e + 1), std::numbers::pi + 1e-9);
  }
}

TEST(SignpostTriangulation, FlippedToDelaunayIsTheSameSurface) {
  for (const mesh::Surface& s : {test::bumpy_grid(9, 7, 0.8, 4), test::torus(13, 5)}) {
    const FlatSurface surface = test::flat(s);
    SignpostTriangulation t(surface);
    const std::vector<double> before = angle_sums(t);
    t.restore_delaunay(ExecutionContext());
    expect_delaunay(t);
    const std::vector<double> after = angle_sums(t);
    for (std::size_t v = 0; v < before.size(); ++v) {
      EXPECT_NEAR(after[v], before[v], 1e-9);
      EXPECT_NEAR(t.vertex(static_cast<VertexId>(v)).total_angle, before[v], 1e-9);
    }
    EXPECT_FALSE(t.take_changed().empty());
    EXPECT_TRUE(t.take_changed().empty());
  }
}

// In the plane every place is known.
TEST(SignpostTriangulation, InsertedPointsLieWhereTheyWereAskedFor) {
  const mesh::Surface s = test::grid(8, 8);
  const FlatSurface surface = test::flat(s);
  SignpostTriangulation t(surface);
  t.restore_delaunay(ExecutionContext());
  const auto in_plane = [&](const AddedPoint& p) -> Vector2 {
    const Vector3 w = surface.weights(p.place);
    Vector2 sum = Vector2::Zero();
    for (int k = 0; k < 3; ++k)
      sum += w[k] * s.vertices.row(s.faces(p.place.face, k)).head<2>().transpose();
    return sum;
  };
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.1, 0.8);
  for (int i = 0; i < 60; ++i) {
    const auto f = static_cast<FaceId>(random() % static_cast<unsigned>(s.faces.rows()));
    const HalfedgeId h = t.face_halfedge(f);
    const auto place_of = [&](VertexId v) -> Vector2 {
      return v < s.vertices.rows() ? Vector2(s.vertices.row(v).head<2>().transpose())
                                   : in_plane(t.vertex(v).point);
    };
    const double b = unit(random), c = (1 - b) * unit(random);
    const VertexId j = t.origin(t.next(h)), k = t.origin(t.next(t.next(h)));
    const Vector2 expected =
        (1 - b - c) * place_of(t.origin(h)) + b * place_of(j) + c * place_of(k);
    const SignpostTriangulation::Place place{h, b * Vector2(t.length(h), 0) + c * t.apex(h),
                                             kInvalid};
    const auto count = static_cast<VertexId>(t.vertices().size());
    ASSERT_TRUE(t.insert(place));
    ASSERT_EQ(t.vertices().size(), static_cast<std::size_t>(count) + 1);
    // Points very near an edge of the input are put on it.
    EXPECT_LT((in_plane(t.vertex(count).point) - expected).norm(), 0.02);
    t.restore_delaunay(ExecutionContext());
    expect_delaunay(t);
  }
  for (const double sum : angle_sums(t)) EXPECT_LT(sum, 2 * std::numbers::pi + 1e-9);
}

TEST(SignpostTriangulation, LinesEndAtTheBoundaryThatTheyWouldCross) {
  const mesh::Surface s = test::grid(4, 4);
  const FlatSurface surface = test::flat(s);
  const SignpostTriangulation t(surface);
  const HalfedgeId h = t.face_halfedge(0);
  const auto inside = t.locate(h, 0.3 * Vector2(t.length(h), 0) + 0.3 * t.apex(h));
  EXPECT_EQ(t.face(inside.h), 0);
  EXPECT_EQ(inside.crossed_boundary, kInvalid);
  EXPECT_NE(t.locate(h, {100.0, 100.0}).crossed_boundary, kInvalid);
}

TEST(SignpostTriangulation, ABoundaryEdgeIsSplitAtItsMiddle) {
  const mesh::Surface s = test::grid(4, 4);
  const FlatSurface surface = test::flat(s);
  SignpostTriangulation t(surface);
  HalfedgeId h = 0;
  while (!t.inside(h) || t.inside(h ^ 1)) ++h;
  const double length = t.length(h);
  const FaceId faces = t.face_count();
  t.split_boundary(h);
  EXPECT_EQ(t.face_count(), faces + 1);
  const SignpostTriangulation::Vertex& middle = t.vertices().back();
  EXPECT_TRUE(middle.boundary);
  EXPECT_NEAR(middle.total_angle, std::numbers::pi, 1e-12);
  EXPECT_NE(middle.point.edge, kInvalid);
  EXPECT_NEAR(middle.point.share, 0.5, 1e-15);
  EXPECT_NEAR(t.length(h), 0.5 * length, 1e-15);
}

}  // namespace
}  // namespace flipfree::intrinsic::signpost_triangulation_test
