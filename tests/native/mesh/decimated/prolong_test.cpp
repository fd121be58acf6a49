#include "flipfree/mesh/decimated/decimated.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/numeric/predicates.h"
#include "support/shapes.h"

namespace flipfree::mesh::prolong_test {
namespace {

bool is_flip_free(const Surface& surface, const Points2& uv) {
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    const Vector2 a = uv.row(surface.faces(f, 0));
    const Vector2 b = uv.row(surface.faces(f, 1));
    const Vector2 c = uv.row(surface.faces(f, 2));
    if (numeric::orientation(a, b, c) <= 0) return false;
  }
  return true;
}

// A flat sheet with uneven rows and columns.
Surface sheet() {
  Surface surface = test::grid(40, 30);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double x = surface.vertices(v, 0);
    const double y = surface.vertices(v, 1);
    surface.vertices.row(v) << x + 0.3 * std::sin(x), y + 0.2 * std::cos(y), 0.0;
  }
  return surface;
}

TEST(Prolong, what_is_flat_is_as_it_was) {
  const Surface surface = sheet();
  ExecutionContext context;
  const Decimated few = decimate(surface, 200, context);
  const Points2 uv = prolong(surface, few, few.surface.vertices.leftCols<2>(), false, context);
  ASSERT_EQ(uv.rows(), surface.vertices.rows());
  EXPECT_LT((uv - surface.vertices.leftCols<2>()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Prolong, a_map_that_is_drawn_out_and_bent_stays_without_flips) {
  const Surface surface = sheet();
  ExecutionContext context;
  const Decimated few = decimate(surface, 200, context);
  const double width = surface.vertices.col(0).maxCoeff() + 1.0;
  for (const double bend : {0.3, 1.0, 2.0}) {
    Points2 polar(few.surface.vertices.rows(), 2);
    for (Eigen::Index v = 0; v < polar.rows(); ++v) {
      const double radius = std::exp(1.0 * few.surface.vertices(v, 1));
      const double angle = -bend * few.surface.vertices(v, 0) / width;
      polar.row(v) << radius * std::cos(angle), radius * std::sin(angle);
    }
    ASSERT_TRUE(is_flip_free(few.surface, polar)) << bend;
    const Points2 uv = prolong(surface, few, polar, false, context);
    ASSERT_EQ(uv.rows(), surface.vertices.rows()) << bend;
    EXPECT_TRUE(is_flip_free(surface, uv)) << bend;
  }
}

// Of the boundary of a map: its least distance from the segments of another one's, at most.
double away(const Surface& surface, const Points2& uv, const Surface& few, const Points2& of_few) {
  const auto loop = [](const Surface& s) {
    return boundary_loops(s.faces, build_adjacency(static_cast<Index>(s.vertices.rows()), s.faces))
        .front();
  };
  const std::vector<VertexId> line = loop(few);
  double most = 0.0;
  for (const VertexId v : loop(surface)) {
    double least = 1e9;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const Vector2 a = of_few.row(line[i]);
      const Vector2 side = of_few.row(line[(i + 1) % line.size()]).transpose() - a;
      const Vector2 p = uv.row(v).transpose() - a;
      const double along = std::clamp(p.dot(side) / side.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (p - along * side).norm());
    }
    most = std::max(most, least);
  }
  return most;
}

TEST(Prolong, the_boundary_stays_on_its_curve_if_it_shall) {
  const Surface surface = sheet();
  ExecutionContext context;
  const Decimated few = decimate(surface, 200, context);
  // Ten times as wide as high: stars at the boundary are drawn out.
  Points2 wide = few.surface.vertices.leftCols<2>();
  wide.col(0) *= 10.0;
  for (Eigen::Index v = 0; v < wide.rows(); ++v) wide(v, 1) += 0.01 * wide(v, 0) * wide(v, 0);
  ASSERT_TRUE(is_flip_free(few.surface, wide));
  const Points2 kept = prolong(surface, few, wide, true, context);
  ASSERT_EQ(kept.rows(), surface.vertices.rows());
  EXPECT_TRUE(is_flip_free(surface, kept));
  EXPECT_LT(away(surface, kept, few.surface, wide), 1e-9);
  EXPECT_GT(away(surface, prolong(surface, few, wide, false, context), few.surface, wide), 1e-3);
}

TEST(Prolong, the_few_keep_their_places) {
  const Surface surface = test::bumpy_grid(30, 30, 0.05, 1.0);
  ExecutionContext context;
  const Decimated few = decimate(surface, 200, context);
  const Points2 flat = few.surface.vertices.leftCols<2>();
  ASSERT_TRUE(is_flip_free(few.surface, flat));
  const Points2 uv = prolong(surface, few, flat, false, context);
  ASSERT_EQ(uv.rows(), surface.vertices.rows());
  EXPECT_TRUE(is_flip_free(surface, uv));
  for (std::size_t i = 0; i < few.origin.size(); ++i)
    EXPECT_EQ(uv.row(few.origin[i]), flat.row(static_cast<Eigen::Index>(i)));
}

}  // namespace
}  // namespace flipfree::mesh::prolong_test
