#include "flipfree/matchmaker/finish/simplify_plane_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "flipfree/distortion/untangle.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::simplify_plane_map_test {
namespace {

// A square grid, its rim first in the numbering, then five inner vertices, which are held; the
// inside is turned about the centre, the less the farther out.
struct Turned {
  PlaneMap plane;
  Index held = 0;
};

Turned turned_grid(Index side) {
  const mesh::Surface surface = test::grid(side, side);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  std::vector<VertexId> order = refined.boundary;
  for (const Index k : {2, 3, 5, 7, 8})
    order.push_back((side + 1) * (side * k / 10) + side / 2 + k - 5);
  Turned result;
  result.held = static_cast<Index>(order.size());
  std::vector<VertexId> number(static_cast<std::size_t>(surface.vertices.rows()), kInvalid);
  for (Index i = 0; i < result.held; ++i)
    number[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])] = i;
  for (VertexId v = 0; v < surface.vertices.rows(); ++v) {
    if (number[static_cast<std::size_t>(v)] != kInvalid) continue;
    number[static_cast<std::size_t>(v)] = static_cast<Index>(order.size());
    order.push_back(v);
  }
  PlaneMap& plane = result.plane;
  plane.faces = surface.faces;
  for (Eigen::Index i = 0; i < plane.faces.size(); ++i)
    plane.faces.data()[i] = number[static_cast<std::size_t>(plane.faces.data()[i])];
  plane.before.resize(surface.vertices.rows(), 2);
  for (std::size_t i = 0; i < order.size(); ++i)
    plane.before.row(static_cast<Eigen::Index>(i)) = surface.vertices.row(order[i]).leftCols(2);
  plane.after = plane.before;
  for (Eigen::Index v = 0; v < plane.after.rows(); ++v) {
    const Vector2 d = plane.before.row(v).transpose() - Vector2(0.5, 0.5);
    const double angle = 0.9 * std::max(0.0, 1.0 - 2.0 * d.norm());
    plane.after.row(v) << 0.5 + std::cos(angle) * d.x() - std::sin(angle) * d.y(),
        0.5 + std::sin(angle) * d.x() + std::cos(angle) * d.y();
  }
  plane.vertex.assign(order.size(), kInvalid);
  std::iota(plane.vertex.begin(), plane.vertex.begin() + result.held, 0);
  return result;
}

TEST(SimplifyPlaneMap, FewVerticesAreLeftAndBothSidesStayPositive) {
  Turned turned = turned_grid(20);
  const PlaneMap before = turned.plane;
  ExecutionContext context;
  ASSERT_TRUE(distortion::find_flips(before.faces, before.after, context).empty());
  simplify_plane_map(turned.plane, turned.held, context);
  const PlaneMap& plane = turned.plane;
  // 356 inner vertices were free; a tenth of them is more than a turned square needs.
  EXPECT_LT(plane.before.rows(), turned.held + 36);
  EXPECT_TRUE(distortion::find_flips(plane.faces, plane.before, context).empty());
  EXPECT_TRUE(distortion::find_flips(plane.faces, plane.after, context).empty());
  EXPECT_EQ(plane.before.rows(), plane.after.rows());
  EXPECT_EQ(static_cast<Eigen::Index>(plane.vertex.size()), plane.before.rows());
  EXPECT_EQ(plane.faces.maxCoeff() + 1, plane.before.rows());
  // A disk: as many faces as its vertices and its rim ask for.
  EXPECT_EQ(plane.faces.rows(), 2 * plane.before.rows() - 2 - 4 * 20);
}

TEST(SimplifyPlaneMap, HeldVerticesStayInBothPlanes) {
  Turned turned = turned_grid(12);
  const PlaneMap before = turned.plane;
  ExecutionContext context;
  simplify_plane_map(turned.plane, turned.held, context);
  for (Index v = 0; v < turned.held; ++v) {
    EXPECT_EQ(turned.plane.before.row(v), before.before.row(v)) << v;
    EXPECT_EQ(turned.plane.after.row(v), before.after.row(v)) << v;
    EXPECT_EQ(turned.plane.vertex[static_cast<std::size_t>(v)], v);
  }
}

TEST(SimplifyPlaneMap, IsTheSameForAnyNumberOfThreads) {
  Turned one = turned_grid(12);
  Turned four = turned_grid(12);
  ExecutionContext alone;
  alone.threads = 1;
  ExecutionContext together;
  together.threads = 4;
  simplify_plane_map(one.plane, one.held, alone);
  simplify_plane_map(four.plane, four.held, together);
  EXPECT_EQ(one.plane.faces, four.plane.faces);
  EXPECT_EQ(one.plane.before, four.plane.before);
  EXPECT_EQ(one.plane.after, four.plane.after);
}

}  // namespace
}  // namespace flipfree::matchmaker::simplify_plane_map_test
