#include "flipfree/unwrap/packing/arrange.h"

#include <gtest/gtest.h>

namespace flipfree::unwrap::similar_test {
namespace {

TEST(Similar, turned_copies_are_found_and_put_on_each_other_but_not_other_sizes) {
  std::vector<mesh::Chart> charts(3);
  std::vector<Points2> uv;
  for (mesh::Chart& chart : charts) {
    chart.surface.vertices.setZero(3, 3);
    chart.surface.faces.resize(1, 3);
    chart.surface.faces << 0, 1, 2;
  }
  Points2 own(3, 2);
  own << 0, 0, 3, 0, 0, 1;
  uv.push_back(own);
  own << 5, 8, 5, 5, 6, 5;  // a quarter turn, other corners first
  uv.push_back(own);
  own << 0, 0, 4, 0, 0, 1;
  uv.push_back(own);
  const std::vector<Stacked> found = similar_charts(charts, uv, {1, 1, 1});
  ASSERT_EQ(found.size(), 0u) << "that one is mirrored";
  uv[1] << 5, 8, 4, 5, 5, 5;
  const std::vector<Stacked> turned = similar_charts(charts, uv, {1, 1, 1});
  ASSERT_EQ(turned.size(), 1u);
  EXPECT_EQ(turned[0].chart, 1u);
  EXPECT_EQ(turned[0].on, 0u);
  const std::vector<Points2> before = uv;
  uv[0] = (uv[0] * 0.1).rowwise() + Eigen::RowVector2d(0.3, 0.4);
  put_on(charts, turned[0], before, uv);
  for (Eigen::Index i = 0; i < 3; ++i) {
    double nearest = 1.0;
    for (Eigen::Index k = 0; k < 3; ++k)
      nearest = std::min(nearest, (uv[1].row(i) - uv[0].row(k)).norm());
    EXPECT_LT(nearest, 1e-9);
  }
}

}  // namespace
}  // namespace flipfree::unwrap::similar_test
