#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/symmetric_dirichlet.h"
#include "flipfree/numeric/dense_factors.h"
#include "fuzz/rational.h"
#include "support/shapes.h"

namespace flipfree::distortion::energy_test {
namespace {

// A bumpy grid's projection with every vertex moved at random, by less where that would flip.
Points2 random_map(const mesh::Surface& surface, double by, std::mt19937& random) {
  std::uniform_real_distribution<double> motion(-by, by);
  const ExecutionContext context;
  Points2 uv = surface.vertices.leftCols<2>();
  for (Eigen::Index v = 0; v < uv.rows(); ++v) {
    const Vector2 before = uv.row(v);
    uv.row(v) += Eigen::RowVector2d(motion(random), motion(random));
    if (!distortion::is_flip_free(surface.faces, uv, context)) uv.row(v) = before;
  }
  return uv;
}

struct Map {
  mesh::Surface surface = flipfree::test::bumpy_grid(6, 5, 0.4, 2.0);
  std::vector<RestTriangle> rest = build_rest_shapes(surface, ExecutionContext()).triangles;
  Points2 uv;
  explicit Map(unsigned seed) {
    std::mt19937 random(seed);
    uv = random_map(surface, 0.1, random);
  }
  EnergySums sums(const Points2& at) const {
    return sum_energy(surface.faces, rest, at, ExecutionContext());
  }
};

TEST(Energy, the_best_scale_is_the_best_and_its_energy_is_foretold) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Map map(seed);
    const EnergySums before = map.sums(map.uv);
    const EnergySums after = map.sums(before.best_scale() * map.uv);
    EXPECT_NEAR(after.value() / before.at_best_scale(), 1.0, 1e-12);
    for (const double beside : {0.99, 1.01}) {
      EXPECT_GT(map.sums(beside * before.best_scale() * map.uv).value(), after.value());
    }
    EXPECT_NEAR(after.log_area - before.log_area, 2.0 * std::log(before.best_scale()), 1e-12);
    double largest = 0.0, sum = 0.0;
    for (std::size_t f = 0; f < map.rest.size(); ++f) {
      const auto at = [&](Index k) {
        return map.uv.data() + 2 * map.surface.faces(static_cast<Eigen::Index>(f), k);
      };
      const Jacobian j = jacobian(map.rest[f], at(0), at(1), at(2));
      const std::array<double, 2> s = singular_values(j);
      const double a = s[0] * before.best_scale(), b = s[1] * before.best_scale();
      const double energy = 0.25 * (a * a + b * b + 1 / (a * a) + 1 / (b * b));
      largest = std::max(largest, energy);
      sum += map.rest[f].weight * energy;
    }
    EXPECT_NEAR(sum / after.value(), 1.0, 1e-11);
    EXPECT_GE(before.worst_at_best_scale(), largest * (1 - 1e-12));
    EXPECT_LE(before.worst_at_best_scale(), 2.0 * largest);
  }
}

TEST(Energy, directional_derivatives_agree_with_differences_of_the_value) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Map map(seed);
    std::mt19937 random(seed + 1000);
    std::uniform_real_distribution<double> unit(-1, 1);
    Points2 direction(map.uv.rows(), 2);
    for (double& x : direction.reshaped()) x = unit(random);
    const double step = 1e-7 * step_to_first_flip(map.surface.faces, map.uv, direction, {});
    ASSERT_GT(step, 0.0);
    const double difference = (map.sums(map.uv + step * direction).value() -
                               map.sums(map.uv - step * direction).value()) /
                              (2 * step);
    const double slope =
        directional_derivative(map.surface.faces, map.rest, map.uv, direction, ExecutionContext());
    EXPECT_NEAR(slope, difference, 1e-5 * map.sums(map.uv).value() / (1e7 * step) + 1e-6);
  }
}

TEST(StepToFirstFlip, the_map_is_flip_free_just_before_it_and_not_just_after) {
  const ExecutionContext context;
  int finite = 0, endless = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    const Map map(seed);
    std::mt19937 random(seed + 2000);
    std::uniform_real_distribution<double> unit(-1, 1);
    Points2 direction(map.uv.rows(), 2);
    if (seed % 3 == 0) {
      direction = map.uv;  // growing for ever
    } else {
      for (double& x : direction.reshaped()) x = unit(random);
    }
    const double step = step_to_first_flip(map.surface.faces, map.uv, direction, context);
    const auto good = [&](double t) {
      return is_flip_free(map.surface.faces, map.uv + t * direction, context);
    };
    if (std::isfinite(step)) {
      ++finite;
      EXPECT_TRUE(good(0.5 * step));
      EXPECT_TRUE(good(step * (1 - 1e-6)));
      EXPECT_FALSE(good(step * (1 + 1e-6)));
    } else {
      ++endless;
      EXPECT_TRUE(good(1.0));
      EXPECT_TRUE(good(100.0));
    }
  }
  EXPECT_GT(finite, 100);
  EXPECT_GT(endless, 50);
}

TEST(FlipFree, agrees_with_rational_numbers_for_any_number_of_threads) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1, 1);
  constexpr Index kFaces = 20000;
  Triangles faces(kFaces, 3);
  Points2 uv(3 * kFaces, 2);
  std::vector<FaceId> expected;
  for (Index f = 0; f < kFaces; ++f) {
    faces.row(f) << 3 * f, 3 * f + 1, 3 * f + 2;
    uv.middleRows<2>(3 * f) << place(random), place(random), place(random), place(random);
    uv.row(3 * f + 2) = uv.row(3 * f) + place(random) * (uv.row(3 * f + 1) - uv.row(3 * f));
    const auto at = [&](Index k) { return fuzz::exact(uv.row(3 * f + k).transpose()); };
    if (fuzz::side(at(0), at(1), at(2)) <= 0) expected.push_back(f);
  }
  for (const int threads : {1, 3}) {
    ExecutionContext context;
    context.threads = threads;
    EXPECT_EQ(flipped_faces(faces, uv, context), expected);
    EXPECT_FALSE(is_flip_free(faces, uv, context));
  }
  Triangles good(kFaces - static_cast<Index>(expected.size()), 3);
  Index next = 0;
  for (Index f = 0; f < kFaces; ++f) {
    if (!std::binary_search(expected.begin(), expected.end(), f)) good.row(next++) = faces.row(f);
  }
  EXPECT_TRUE(is_flip_free(good, uv, ExecutionContext()));
}

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
}  // namespace flipfree::distortion::energy_test
