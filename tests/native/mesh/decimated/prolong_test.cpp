#include "flipfree/mesh/decimated/prolong.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"
#include "support/shapes.h"

namespace flipfree::mesh {
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
  const Points2 uv = prolong(surface, few, few.surface.vertices.leftCols<2>(), context);
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
    const Points2 uv = prolong(surface, few, polar, context);
    ASSERT_EQ(uv.rows(), surface.vertices.rows()) << bend;
    EXPECT_TRUE(is_flip_free(surface, uv)) << bend;
  }
}

TEST(Prolong, the_few_keep_their_places) {
  const Surface surface = test::bumpy_grid(30, 30, 0.05, 1.0);
  ExecutionContext context;
  const Decimated few = decimate(surface, 200, context);
  const Points2 flat = few.surface.vertices.leftCols<2>();
  ASSERT_TRUE(is_flip_free(few.surface, flat));
  const Points2 uv = prolong(surface, few, flat, context);
  ASSERT_EQ(uv.rows(), surface.vertices.rows());
  EXPECT_TRUE(is_flip_free(surface, uv));
  for (std::size_t i = 0; i < few.origin.size(); ++i)
    EXPECT_EQ(uv.row(few.origin[i]), flat.row(static_cast<Eigen::Index>(i)));
}

}  // namespace
}  // namespace flipfree::mesh
