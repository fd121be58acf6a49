#include "flipfree/distortion/energy/symmetric_dirichlet.h"
#include "flipfree/numeric/dense_factors.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

namespace flipfree::distortion::symmetric_dirichlet_test {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

RestTriangle rest_of(const Vector2& e1, const Vector2& e2, double weight) {
  const double det = e1.x() * e2.y() - e1.y() * e2.x();
  RestTriangle rest;
  rest.gradient[0][0] = e2.y() / det;
  rest.gradient[0][1] = -e2.x() / det;
  rest.gradient[1][0] = -e1.y() / det;
  rest.gradient[1][1] = e1.x() / det;
  rest.determinant = 1 / det;
  rest.weight = weight;
  return rest;
}

Jacobian jacobian_at(const RestTriangle& rest, const Vector6& x) {
  return jacobian(rest, x.data(), x.data() + 2, x.data() + 4);
}

Vector6 gradient_at(const RestTriangle& rest, const Vector6& x) {
  Vector6 g;
  symmetric_dirichlet_derivatives(rest, jacobian_at(rest, x), g.data(), nullptr);
  return g;
}

Matrix6 hessian_at(const RestTriangle& rest, const Vector6& x) {
  Vector6 g;
  double h[kHessianEntries];
  symmetric_dirichlet_derivatives(rest, jacobian_at(rest, x), g.data(), h);
  Matrix6 full;
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    full.block<2, 2>(2 * k, 2 * k) << h[3 * k], h[3 * k + 1], h[3 * k + 1], h[3 * k + 2];
    full.block<2, 2>(2 * k, 2 * l) << h[9 + 4 * k], h[10 + 4 * k], h[11 + 4 * k], h[12 + 4 * k];
    full.block<2, 2>(2 * l, 2 * k) = full.block<2, 2>(2 * k, 2 * l).transpose();
  }
  return full;
}

Matrix6 hessian_by_differences(const RestTriangle& rest, const Vector6& x, double step) {
  Matrix6 hessian;
  for (int i = 0; i < 6; ++i) {
    const Vector6 e = step * Vector6::Unit(i);
    hessian.col(i) = (gradient_at(rest, x + e) - gradient_at(rest, x - e)) / (2 * step);
  }
  return hessian;
}

// Random positively oriented triangles, `shrink` times as large as their rest shapes.
struct Case {
  RestTriangle rest;
  Vector6 x;
};
std::vector<Case> cases(double shrink) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Case> all;
  while (all.size() < 200) {
    const Vector2 e1{unit(random), unit(random)};  // in this order, which (...) leaves open
    const Vector2 e2{unit(random), unit(random)};
    Vector6 x;
    for (int i = 0; i < 6; ++i) x(i) = shrink * unit(random);
    const double det = (x(2) - x(0)) * (x(5) - x(1)) - (x(3) - x(1)) * (x(4) - x(0));
    if (e1.x() * e2.y() - e1.y() * e2.x() < 0.1 || det < 0.1 * shrink * shrink) continue;
    all.push_back({rest_of(e1, e2, 0.7), x});
  }
  return all;
}

TEST(SymmetricDirichlet, IsOneForRotationsOfTheRestShape) {
  const RestTriangle rest = rest_of({2, 0.5}, {-0.3, 1}, 1);
  const double c = std::cos(0.7);
  const double s = std::sin(0.7);
  Vector6 x;
  x << 1, 1, 1 + 2 * c - 0.5 * s, 1 + 2 * s + 0.5 * c, 1 - 0.3 * c - s, 1 - 0.3 * s + c;
  EXPECT_NEAR(symmetric_dirichlet(jacobian_at(rest, x)), 1.0, 1e-14);
  EXPECT_LT(gradient_at(rest, x).norm(), 1e-13);
}

TEST(SymmetricDirichlet, GradientAgreesWithDifferencesOfTheValue) {
  for (const auto& [rest, x] : cases(1.0)) {
    const Vector6 g = gradient_at(rest, x);
    for (int i = 0; i < 6; ++i) {
      const Vector6 e = 1e-6 * Vector6::Unit(i);
      const double difference = rest.weight *
                                (symmetric_dirichlet(jacobian_at(rest, x + e)) -
                                 symmetric_dirichlet(jacobian_at(rest, x - e))) /
                                2e-6;
      EXPECT_NEAR(g(i), difference, 1e-6 * (1 + g.norm()));
    }
  }
}

TEST(SymmetricDirichlet, HessianAgreesWithDifferencesOfTheGradientWhereNothingIsClamped) {
  // Stretched maps: the twist eigenvalue 1 - x y (x^2 - x y + y^2) is positive, the Hessian is
  // exact.
  int exact = 0;
  for (const auto& [rest, x] : cases(30.0)) {
    const auto s = singular_values(jacobian_at(rest, x));
    if (s[1] <= 1.0) continue;
    ++exact;
    const Matrix6 h = hessian_at(rest, x);
    const Matrix6 difference = hessian_by_differences(rest, x, 1e-5);
    EXPECT_LT((h - difference).norm(), 1e-6 * h.norm());
  }
  EXPECT_GT(exact, 100);
}

TEST(SymmetricDirichlet, HessianIsPositiveSemidefiniteWhereTheTrueOneIsNot) {
  int clamped = 0;
  for (const auto& [rest, x] : cases(0.3)) {
    const Matrix6 h = hessian_at(rest, x);
    const Matrix6 difference = hessian_by_differences(rest, x, 1e-6);
    const Eigen::VectorXd projected = numeric::symmetric_eigen(Eigen::MatrixXd(h)).values;
    const Eigen::VectorXd truth =
        numeric::symmetric_eigen(Eigen::MatrixXd(0.5 * (difference + difference.transpose())))
            .values;
    EXPECT_GT(projected(0), -1e-10 * projected(5));
    if (truth(0) < -1e-4 * truth(5)) {
      ++clamped;
      // Only one eigenvalue of J's four can be negative, so only one of the six.
      EXPECT_GT(truth(1), -1e-4 * truth(5));
    }
  }
  EXPECT_GT(clamped, 50);
}

TEST(SymmetricDirichlet, DeterminantOfSliversKeepsItsSmallPositiveValue) {
  // (1 + e)(1 - e) - 1 = -e^2 is lost in the rounding of longer products.
  const double e = std::ldexp(1.0, -20);
  EXPECT_DOUBLE_EQ(positive_determinant(1.0, 1.0 + e, 1.0 - e, 1.0), e * e);
  // What rounding of the entries may hide still is positive.
  EXPECT_GT(positive_determinant(1.0, 1.0, 1.0, 1.0), 0.0);
}

}  // namespace
}  // namespace flipfree::distortion::symmetric_dirichlet_test
