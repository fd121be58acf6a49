// The overlay is checked against geometry it knows nothing of: straight segments in the plane.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "flipfree/intrinsic/overlay.h"
#include "flipfree/numeric/predicates.h"
#include "support/flip_meshes.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::overlay_coordinates_test {
namespace {

bool flippable(const FlipMesh& mesh, HalfedgeId h) { return !is_glued_to_itself(mesh, h >> 1); }

std::vector<HalfedgeId> all_curves(const FlipMesh& mesh) {
  std::vector<HalfedgeId> curves;
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); h += 2) curves.push_back(h);
  return curves;
}

TEST(Overlay, RandomFlipsAndTheirInversesEndWhereTheyBegan) {
  std::mt19937 random(7);
  const mesh::Surface surface = test::sphere(9, 6);
  OverlayCoordinates coordinates(test::closed_mesh(surface));
  std::vector<HalfedgeId> done;
  const auto count = static_cast<unsigned>(coordinates.current().halfedge_count());
  for (int i = 0; i < 400; ++i) {
    const auto h = static_cast<HalfedgeId>(random() % count);
    if (!flippable(coordinates.current(), h)) continue;
    coordinates.flip(h);
    done.push_back(h);
  }
  ExecutionContext context;
  const OverlayTrace trace =
      trace_overlay(coordinates, all_curves(coordinates.input()), 100'000'000, context);
  std::int64_t crossings = 0;
  std::set<VertexId> valence_one;
  for (HalfedgeId h = 0; at(h) < coordinates.current().halfedge_count(); h += 2) {
    crossings += coordinates.crossings(h);
  }
  for (HalfedgeId h = 0; at(h) < coordinates.current().halfedge_count(); ++h) {
    if (coordinates.current().rotate_ccw(h) == h)
      valence_one.insert(coordinates.current().origin_of(h));
  }
  EXPECT_EQ(crossings, static_cast<std::int64_t>(trace.crossings.size()));
  EXPECT_GT(crossings, 500);
  EXPECT_GT(valence_one.size(), 0u);  // the case is hard enough
  EXPECT_EQ(find_broken_invariant(coordinates.current()), "");
  // Three more flips of an edge undo one: a flip turns it by a quarter, four give the identity.
  for (auto h = done.rbegin(); h != done.rend(); ++h) {
    for (int k = 0; k < 3; ++k) coordinates.flip(*h);
  }
  EXPECT_EQ(coordinates.current().next, coordinates.input().next);
  EXPECT_EQ(coordinates.current().origin, coordinates.input().origin);
  for (HalfedgeId h = 0; at(h) < coordinates.current().halfedge_count(); ++h) {
    EXPECT_TRUE(coordinates.shared(h));
    EXPECT_EQ(coordinates.star(coordinates.current().origin_of(h))[coordinates.roundabout(h)], h);
  }
}

// Flips of convex quadrilaterals of a planar triangulation keep edges straight, so curves cross
// exactly where segments do; Penner lengths are not Euclidean here, only the combinatorics is
// compared.
TEST(Overlay, CrossingsAreThoseOfStraightSegmentsInThePlane) {
  std::mt19937 random(3);
  mesh::Surface surface = test::grid(7, 7);
  std::uniform_real_distribution<double> jitter(-0.05, 0.05);
  for (Index v = 0; v < surface.vertices.rows(); ++v) {
    surface.vertices(v, 0) += jitter(random);
    surface.vertices(v, 1) += jitter(random);
  }
  const auto point = [&](Index v) {
    return Vector2(surface.vertices(v, 0), surface.vertices(v, 1));
  };
  OverlayCoordinates coordinates(test::closed_mesh(surface));
  const auto apex_vertex = static_cast<Index>(surface.vertices.rows());
  const FlipMesh& mesh = coordinates.current();
  int flips = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto h = static_cast<HalfedgeId>(random() % static_cast<unsigned>(mesh.halfedge_count()));
    const Index a = mesh.origin_of(h), b = mesh.origin_of(h ^ 1);
    const Index k = mesh.origin_of(mesh.previous(h)), l = mesh.origin_of(mesh.previous(h ^ 1));
    if (std::max({a, b, k, l}) >= apex_vertex) continue;
    if (numeric::orientation(point(l), point(k), point(a)) <= 0 ||
        numeric::orientation(point(k), point(l), point(b)) <= 0)
      continue;
    coordinates.flip(h);
    ++flips;
  }
  ASSERT_GT(flips, 300);
  ExecutionContext context;
  const OverlayTrace trace =
      trace_overlay(coordinates, all_curves(coordinates.input()), 1'000'000, context);
  const auto cross = [&](Index a, Index b, Index c, Index d) {
    if (a == c || a == d || b == c || b == d) return false;
    return numeric::orientation(point(a), point(b), point(c)) !=
               numeric::orientation(point(a), point(b), point(d)) &&
           numeric::orientation(point(c), point(d), point(a)) !=
               numeric::orientation(point(c), point(d), point(b));
  };
  for (std::size_t c = 0; c < trace.curves.size(); ++c) {
    const HalfedgeId g = trace.curves[c];
    const Index a = coordinates.input().origin_of(g), b = coordinates.input().origin_of(g ^ 1);
    if (std::max(a, b) >= apex_vertex) continue;
    std::set<EdgeId> expected;
    for (EdgeId e = 0; at(e) < mesh.edge_count(); ++e) {
      const Index s = mesh.origin_of(2 * e), t = mesh.origin_of(2 * e + 1);
      if (std::max(s, t) < apex_vertex && cross(a, b, s, t)) expected.insert(e);
    }
    std::set<EdgeId> found;
    double last = -1;
    for (const Crossing& crossing : trace.of_curve(c)) {
      found.insert(crossing.through >> 1);
      // In order along the curve.
      const Vector2 p = point(a), d = point(b) - p;
      const Vector2 s = point(mesh.origin_of(crossing.through)),
                    e = point(mesh.origin_of(crossing.through ^ 1)) - s;
      const double along =
          ((s - p).x() * e.y() - (s - p).y() * e.x()) / (d.x() * e.y() - d.y() * e.x());
      EXPECT_GT(along, last);
      // The curve leaves through the half-edge: the face it comes from is on its left.
      EXPECT_LT(e.x() * d.y() - e.y() * d.x(), 0.0);
      last = along;
    }
    EXPECT_EQ(found, expected);
  }
}

}  // namespace
}  // namespace flipfree::intrinsic::overlay_coordinates_test
