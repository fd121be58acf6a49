#include "flipfree/unwrap/seams/slits/drawn_out.h"

#include <gtest/gtest.h>

#include "flipfree/certify/measures.h"
#include "flipfree/distortion/energy/energy.h"
#include "support/shapes.h"

namespace flipfree::unwrap::drawn_out_test {
namespace {

double most_energy(const mesh::Surface& surface, const Points2& uv) {
  Points2 corners(surface.faces.size(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c) corners.row(c) = uv.row(surface.faces.data()[c]);
  return certify::symmetric_dirichlet(surface, corners).maximum;
}

class DrawnOut : public ::testing::Test {
 protected:
  // A flat sheet as it is, at another unit, but for two vertices far apart: one inside, and one on
  // the boundary, each nearly on a neighbour.
  DrawnOut() : sheet_(test::grid(40, 40)), uv_(3.0 * sheet_.vertices.leftCols<2>()) {
    uv_.row(kInside) = 0.02 * uv_.row(kInside) + 0.98 * uv_.row(kInside + 1);
    uv_.row(kBorder) = 0.02 * uv_.row(kBorder) + 0.98 * uv_.row(kBorder + 1);
  }

  static constexpr VertexId kInside = 41 * 30 + 30;
  static constexpr VertexId kBorder = 10;
  mesh::Surface sheet_;
  Points2 uv_;
  ExecutionContext context_;
};

TEST_F(DrawnOut, places_come_right_and_the_rest_stays_bit_for_bit) {
  ASSERT_GT(most_energy(sheet_, uv_), 10.0);
  const Points2 relaxed = relaxed_where_drawn_out(sheet_, uv_, false, context_);
  EXPECT_TRUE(distortion::is_flip_free(sheet_.faces, relaxed, context_));
  EXPECT_LT(most_energy(sheet_, relaxed), 2.0);
  Index same = 0;
  for (Eigen::Index v = 0; v < uv_.rows(); ++v) same += relaxed.row(v) == uv_.row(v) ? 1 : 0;
  EXPECT_GT(same, 1400);
}

TEST_F(DrawnOut, the_boundary_stays_if_it_shall) {
  const Points2 relaxed = relaxed_where_drawn_out(sheet_, uv_, true, context_);
  for (VertexId v = 0; v <= 40; ++v) EXPECT_EQ(relaxed.row(v), uv_.row(v)) << v;
  EXPECT_NE(relaxed.row(kInside), uv_.row(kInside));
}

TEST_F(DrawnOut, the_number_of_threads_does_not_change_a_bit) {
  context_.threads = 1;
  const Points2 one = relaxed_where_drawn_out(sheet_, uv_, false, context_);
  context_.threads = 3;
  EXPECT_EQ(relaxed_where_drawn_out(sheet_, uv_, false, context_), one);
}

}  // namespace
}  // namespace flipfree::unwrap::drawn_out_test
