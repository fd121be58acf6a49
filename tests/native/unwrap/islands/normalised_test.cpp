#include "flipfree/unwrap/islands/islands.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/shapes.h"

namespace flipfree::unwrap::normalised_test {
namespace {

TEST(Normalised, components_lie_around_the_origin_in_one_unit) {
  const mesh::Surface ball = test::sphere(6, 4);
  const Eigen::Index count = ball.vertices.rows();
  Points3 positions(2 * count, 3);
  positions << std::ldexp(1.0, 40) * ball.vertices, std::ldexp(1.0, 38) * ball.vertices;
  positions.bottomRows(count).rowwise() += Vector3(0, std::ldexp(1.0, 45), 0).transpose();
  Triangles faces(2 * ball.faces.rows(), 3);
  faces << ball.faces, ball.faces.array() + static_cast<Index>(count);
  const Points3 result = normalised(positions, faces);
  EXPECT_LE(result.cwiseAbs().maxCoeff(), 1.0);
  EXPECT_GE(result.cwiseAbs().maxCoeff(), 0.25);
  for (const Eigen::Index first : {Eigen::Index{0}, count}) {
    const Points3 part = result.middleRows(first, count);
    EXPECT_NEAR((part.colwise().maxCoeff() + part.colwise().minCoeff()).norm(), 0.0, 1e-11);
  }
  EXPECT_NEAR(result.topRows(count).norm() / result.bottomRows(count).norm(), 4.0, 1e-3);
}

}  // namespace
}  // namespace flipfree::unwrap::normalised_test
