#include "flipfree/distortion/energy/foldover_free.h"
#include "flipfree/numeric/dense_factors.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <random>

namespace flipfree::distortion::foldover_free_test {
namespace {

using foldover_free::Matrix4;
using foldover_free::Vector4;
using Wide = Eigen::Matrix<long double, 4, 1>;

// The formula of untangle.h, in 80 bits.
long double value(const Wide& j, long double lambda, long double epsilon) {
  const long double d = j[0] * j[3] - j[1] * j[2];
  const long double root = std::sqrt(d * d + epsilon * epsilon);
  const long double chi = d > 0 ? (d + root) / 2 : epsilon * epsilon / (root - d) / 2;
  return (j.squaredNorm() + lambda * (d * d + 1)) / chi;
}

struct Case {
  Vector4 j;
  double lambda, epsilon;
};
// Flipped, positive, similarities, mirrored ones and zero.
std::vector<Case> cases() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Case> all;
  for (int i = 0; i < 400; ++i) {
    Vector4 j(unit(random), unit(random), unit(random), unit(random));
    if (i % 10 == 0) j = Vector4(j[0], -j[1], j[1], j[0]);
    if (i % 10 == 1) j = Vector4(j[0], j[1], j[1], -j[0]);
    all.push_back({j, 0.5 * (1 + unit(random)), std::pow(10.0, -1 + unit(random))});
  }
  // Near rotations, where f is convex.
  for (int i = 0; i < 100; ++i) {
    const double angle = 3.0 * unit(random);
    const double c = std::cos(angle), s = std::sin(angle);
    all.push_back({Vector4(c, -s, s, c) +
                       0.1 * Vector4(unit(random), unit(random), unit(random), unit(random)),
                   0.1, 1e-3});
  }
  all.push_back({Vector4::Zero(), 0.1, 0.5});
  return all;
}

TEST(FoldoverFree, the_gradient_agrees_with_differences_of_the_value) {
  for (const Case& c : cases()) {
    Vector4 gradient;
    Matrix4 hessian;
    foldover_free::derivatives(c.j, c.lambda, c.epsilon, gradient, hessian);
    for (int k = 0; k < 4; ++k) {
      const long double h = 1e-7L * c.epsilon;
      Wide plus = c.j.cast<long double>(), minus = plus;
      plus[k] += h;
      minus[k] -= h;
      const auto difference = static_cast<double>(
          (value(plus, c.lambda, c.epsilon) - value(minus, c.lambda, c.epsilon)) / (2 * h));
      EXPECT_NEAR(gradient[k], difference, 1e-6 * (1 + gradient.norm()));
    }
  }
}

TEST(FoldoverFree, the_hessian_is_that_of_differences_with_its_negative_part_taken_away) {
  int clamped = 0, whole = 0;
  for (const Case& c : cases()) {
    Vector4 gradient;
    Matrix4 hessian, differences;
    foldover_free::derivatives(c.j, c.lambda, c.epsilon, gradient, hessian);
    const double h = 1e-6 * c.epsilon;
    for (int k = 0; k < 4; ++k) {
      Vector4 plus, minus;
      Matrix4 unused;
      const Vector4 step = h * Vector4::Unit(k);
      foldover_free::derivatives(c.j + step, c.lambda, c.epsilon, plus, unused);
      foldover_free::derivatives(c.j - step, c.lambda, c.epsilon, minus, unused);
      differences.col(k) = (plus - minus) / (2 * h);
    }
    const auto eigen =
        numeric::symmetric_eigen(Eigen::MatrixXd(0.5 * (differences + differences.transpose())));
    const Matrix4 expected =
        eigen.vectors * eigen.values.cwiseMax(0.0).asDiagonal() * eigen.vectors.transpose();
    EXPECT_LT((hessian - expected).norm(), 1e-5 * differences.norm());
    EXPECT_GE(numeric::symmetric_eigen(Eigen::MatrixXd(hessian)).values[0],
              -1e-12 * hessian.norm());
    (eigen.values[0] < -1e-3 * differences.norm() ? clamped : whole)++;
  }
  EXPECT_GT(clamped, 50);
  EXPECT_GT(whole, 50);
}

}  // namespace
}  // namespace flipfree::distortion::foldover_free_test
