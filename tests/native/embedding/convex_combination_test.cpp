#include "flipfree/embedding/tutte/convex_combination.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <boost/multiprecision/gmp.hpp>
#include <cmath>
#include <map>
#include <random>

#include "flipfree/base/error.h"

namespace flipfree::embedding::convex_combination_test {
namespace {

using Rational = boost::multiprecision::mpq_rational;

// x as Gauss eliminates it in rational numbers.
std::vector<Rational> exact_solution(const ConvexCombinations& system, Index axis) {
  const auto n = system.fixed_weight.size();
  std::vector<std::vector<Rational>> a(n, std::vector<Rational>(n + 1, 0));
  for (std::size_t i = 0; i < n; ++i) {
    a[i][i] += Rational(system.fixed_weight[i]);
    for (Index k = system.start[i]; k < system.start[i + 1]; ++k) {
      const Rational weight(system.weight[static_cast<std::size_t>(k)]);
      a[i][i] += weight;
      a[i][static_cast<std::size_t>(system.column[static_cast<std::size_t>(k)])] -= weight;
    }
    a[i][n] = Rational(system.fixed_sum(static_cast<Eigen::Index>(i), axis));
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      const Rational factor = a[j][i] / a[i][i];
      for (std::size_t k = i; factor != 0 && k <= n; ++k) a[j][k] -= factor * a[i][k];
    }
  }
  std::vector<Rational> x(n);
  for (std::size_t i = n; i-- > 0;) {
    x[i] = a[i][n];
    for (std::size_t k = i + 1; k < n; ++k) x[i] -= a[i][k] * x[k];
    x[i] /= a[i][i];
  }
  return x;
}

// Weights over sixty orders of magnitude, not symmetric; fixed points in the positive quadrant.
ConvexCombinations random_system(Index n, std::mt19937& random) {
  std::uniform_real_distribution<double> exponent(-30.0, 30.0);
  const auto weight = [&] { return std::pow(10.0, exponent(random)); };
  std::vector<std::map<Index, double>> rows(static_cast<std::size_t>(n));
  const auto join = [&](Index i, Index j) {
    rows[static_cast<std::size_t>(i)][j] = weight();
    rows[static_cast<std::size_t>(j)][i] = weight();
  };
  for (Index i = 1; i < n; ++i) join(i, static_cast<Index>(random() % static_cast<unsigned>(i)));
  for (Index e = 0; e < n; ++e) {
    const auto i = static_cast<Index>(random() % static_cast<unsigned>(n));
    const auto j = static_cast<Index>(random() % static_cast<unsigned>(n));
    if (i != j) join(i, j);
  }
  ConvexCombinations system;
  system.start = {0};
  system.fixed_sum = Points2::Zero(n, 2);
  for (Index i = 0; i < n; ++i) {
    for (const auto& [j, w] : rows[static_cast<std::size_t>(i)]) {
      system.column.push_back(j);
      system.weight.push_back(w);
    }
    system.start.push_back(static_cast<Index>(system.column.size()));
    const bool fixed = i == 0 || random() % 3 == 0;
    const double w = fixed ? weight() : 0.0;
    system.fixed_weight.push_back(w);
    std::uniform_real_distribution<double> place(0.0, 1.0);
    if (fixed) system.fixed_sum.row(i) << w * place(random), w * place(random);
  }
  return system;
}

TEST(ConvexCombination, every_coordinate_is_accurate_relative_to_itself) {
  std::mt19937 random(1);
  for (int round = 0; round < 60; ++round) {
    const Index n = 1 + static_cast<Index>(random() % 25);
    const ConvexCombinations system = random_system(n, random);
    ExecutionContext context;
    const Points2 x = solve_convex_combinations(system, context);
    for (const Index axis : {0, 1}) {
      const std::vector<Rational> exact = exact_solution(system, axis);
      for (Index i = 0; i < n; ++i) {
        const Rational error = Rational(x(i, axis)) / exact[static_cast<std::size_t>(i)] - 1;
        EXPECT_LT(std::abs(static_cast<double>(error)), 1e-12);
      }
    }
  }
}

TEST(ConvexCombination, unknowns_without_a_path_to_a_fixed_point_are_refused) {
  ConvexCombinations system;
  system.start = {0, 1, 2};
  system.column = {1, 0};
  system.weight = {1.0, 1.0};
  system.fixed_weight = {0.0, 0.0};
  system.fixed_sum = Points2::Zero(2, 2);
  ExecutionContext context;
  try {
    solve_convex_combinations(system, context);
    FAIL();
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kFactorizationFailed);
  }
}

}  // namespace
}  // namespace flipfree::embedding::convex_combination_test
