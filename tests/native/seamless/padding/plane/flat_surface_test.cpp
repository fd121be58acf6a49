// Flat surfaces as vectors: flips, moves and the Delaunay triangulation keep them flat.
#include "flipfree/seamless/padding/plane/flat_surface.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "seamless/padding/geometry/hand_cuts.h"

namespace flipfree::seamless::flat_surface_test {
namespace {

// Three times the area of all faces, from twice the area of the face of every half-edge.
double area_of(const FlatSurface& flat) {
  double sum = 0.0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flat.mesh.halfedge_count()); ++h)
    sum += flat.area(h).to_double() / 6.0;
  return sum;
}

FlatSurface square() {
  ExecutionContext context;
  return test::assembled(test::square_cut(test::GridTorus(8, 8)), context).flat;
}

// A half-edge along the cut whose origin has no corner: the next one goes straight on.
HalfedgeId inner_boundary(const FlatSurface& flat) {
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flat.mesh.halfedge_count()); ++h) {
    if (!flat.fixed[static_cast<std::size_t>(h / 2)]) continue;
    HalfedgeId before = h;
    Wide turn(0.0);
    int faces = 0;
    do {
      before = flat.mesh.previous(before);
      ++faces;
      if (flat.fixed[static_cast<std::size_t>(before / 2)]) break;
      before ^= 1;
    } while (faces < 100);
    if (faces >= 3) return h;
  }
  return kInvalid;
}

TEST(FlatSurface, TwoFlipsGiveTheSurfaceBack) {
  FlatSurface flat = square();
  const double area = area_of(flat);
  for (EdgeId e = 0; e < static_cast<EdgeId>(flat.mesh.edge_count()); ++e) {
    if (flat.fixed[static_cast<std::size_t>(e)]) continue;
    const WideVector before = flat.vector[static_cast<std::size_t>(2 * e)];
    flat.flip(e);
    flat.flip(e);
    const WideVector after = flat.vector[static_cast<std::size_t>(2 * e)];
    EXPECT_NEAR(norm(after).to_double(), norm(before).to_double(), 1e-12);
  }
  EXPECT_NEAR(area_of(flat), area, 1e-12 * area);
  EXPECT_LT(measure_flatness(flat).length, 1e-9);
}

TEST(FlatSurface, AVertexMovesOutwardsAndBack) {
  FlatSurface flat = square();
  const double area = area_of(flat);
  const HalfedgeId h = inner_boundary(flat);
  ASSERT_NE(h, kInvalid);
  const Wide side = norm(flat.vector[static_cast<std::size_t>(h)]);
  ExecutionContext context;
  const auto shift = [&](double along, double outward) {
    const Wide x(along), y(-outward);
    return turned({x * side, y * side}, flat.axis[static_cast<std::size_t>(h)]);
  };
  move_wedge(flat, h, shift(0.4, 5.0), context);
  EXPECT_TRUE(measure_flatness(flat).positive);
  EXPECT_GT(area_of(flat), area);
  move_wedge(flat, h, shift(-0.4, -5.0), context);
  EXPECT_TRUE(measure_flatness(flat).positive);
  EXPECT_NEAR(area_of(flat), area, 1e-9 * area);
}

TEST(FlatSurface, AVertexDoesNotPassItsNeighbour) {
  FlatSurface flat = square();
  const HalfedgeId h = inner_boundary(flat);
  const WideVector side = flat.vector[static_cast<std::size_t>(h)];
  ExecutionContext context;
  EXPECT_THROW(move_wedge(flat, h, Wide(1.5) * side, context), NotConverged);
}

TEST(FlatSurface, DelaunayFlipsKeepItFlat) {
  FlatSurface flat = square();
  ExecutionContext context;
  const HalfedgeId h = inner_boundary(flat);
  const Wide far = Wide(-3.0) * norm(flat.vector[static_cast<std::size_t>(h)]);
  const Index axis = flat.axis[static_cast<std::size_t>(h)];
  move_wedge(flat, h, turned({Wide(0.0), far}, axis), context);
  const double area = area_of(flat);
  make_delaunay(flat, context);
  const FlatError error = measure_flatness(flat);
  EXPECT_TRUE(error.positive);
  EXPECT_LT(error.length, 1e-8);
  EXPECT_NEAR(area_of(flat), area, 1e-8 * area);
  const std::size_t flips = flat.flips.size();
  make_delaunay(flat, context);
  EXPECT_EQ(flat.flips.size(), flips);
}

}  // namespace
}  // namespace flipfree::seamless::flat_surface_test
