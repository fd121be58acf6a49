#include "flipfree/distortion/energy/working_rest.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "distortion/random_maps.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "support/dense.h"

namespace flipfree::distortion::working_rest_test {
namespace {

struct Case {
  mesh::Surface surface = flipfree::test::bumpy_grid(8, 8, 0.4, 2.0);
  std::vector<RestTriangle> rest = build_rest_shapes(surface, ExecutionContext()).triangles;
  Points2 uv;
  explicit Case(unsigned seed) {
    std::mt19937 random(seed);
    uv = test::random_map(surface, 0.15, random);
    uv.col(0) *= 1.0 + static_cast<double>(seed % 7);
  }
  Eigen::Matrix2d jacobian_of(const RestTriangle& triangle, std::size_t f) const {
    const auto at = [&](Index k) {
      return uv.data() + 2 * surface.faces(static_cast<Eigen::Index>(f), k);
    };
    const Jacobian j = jacobian(triangle, at(0), at(1), at(2));
    EXPECT_NEAR(j.determinant / (j.a * j.d - j.b * j.c), 1.0, 1e-6);
    Eigen::Matrix2d matrix;
    matrix << j.a, j.b, j.c, j.d;
    return matrix;
  }
};

double energy(const Eigen::Matrix2d& j) {
  return 0.25 * (j.squaredNorm() + j.inverse().squaredNorm());
}

TEST(ScaleRest, divides_lengths_and_so_multiplies_jacobians) {
  const Case c(1);
  std::vector<RestTriangle> working(3);  // of another size
  scale_rest(c.rest, 2.5, ExecutionContext(), working);
  ASSERT_EQ(working.size(), c.rest.size());
  for (std::size_t f = 0; f < working.size(); ++f) {
    EXPECT_LT((c.jacobian_of(working[f], f) - 2.5 * c.jacobian_of(c.rest[f], f)).norm(), 1e-11);
    EXPECT_EQ(working[f].weight, c.rest[f].weight);
  }
}

TEST(ProgressiveRest, bounds_every_triangle_by_powers_of_its_singular_values) {
  int drawn = 0, kept = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Case c(seed);
    const double scale = 0.3 + 0.1 * static_cast<double>(seed);
    std::vector<RestTriangle> working, scaled;
    progressive_rest(c.surface.faces, c.rest, scale, c.uv, ExecutionContext(), working);
    scale_rest(c.rest, scale, ExecutionContext(), scaled);
    for (std::size_t f = 0; f < working.size(); ++f) {
      EXPECT_EQ(working[f].weight, 1.0 / static_cast<double>(working.size()));
      const Eigen::Matrix2d before = c.jacobian_of(scaled[f], f);
      const Eigen::Matrix2d now = c.jacobian_of(working[f], f);
      if (energy(before) <= kProgressiveBound) {
        ++kept;
        EXPECT_EQ(now, before);
        continue;
      }
      ++drawn;
      EXPECT_NEAR(energy(now), kProgressiveBound, 1e-6);
      const test::SingularValues svd = test::singular_values(before);
      const Eigen::Matrix2d middle = svd.u.transpose() * now * svd.v;
      EXPECT_NEAR(middle(0, 1), 0.0, 1e-7 * now.norm());
      EXPECT_NEAR(middle(1, 0), 0.0, 1e-7 * now.norm());
      const double t = std::log(middle(0, 0)) / std::log(svd.values[0]);
      EXPECT_NEAR(std::log(middle(1, 1)), t * std::log(svd.values[1]), 1e-6);
      EXPECT_GE(t, 0.0);
      EXPECT_LT(t, 1.0);
    }
  }
  EXPECT_GT(drawn, 100);
  EXPECT_GT(kept, 100);
}

}  // namespace
}  // namespace flipfree::distortion::working_rest_test
