#include "flipfree/numeric/cholesky/laplacian_factor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "flipfree/numeric/scalar.h"

namespace flipfree::numeric::laplacian_factor_test {
namespace {

TEST(LaplacianFactor, is_accurate_entry_by_entry_where_weights_span_sixty_orders_of_magnitude) {
  // A path 0 - 1 - ... - n-1: a unit current from 0 to the fixed end makes potentials sums of
  // resistances.
  const Index n = 61;
  std::vector<Coupling> path;
  for (Index i = 0; i + 1 < n; ++i)
    path.push_back({i, i + 1, std::pow(10.0, i % 2 == 0 ? 30 - i : i - 30)});
  LaplacianFactor factor;
  ExecutionContext context;
  ASSERT_TRUE(factor.factorize(n, path, context));
  std::vector<double> b(static_cast<std::size_t>(n), 0.0);
  b[0] = 1.0;
  factor.solve(b, context);
  double potential = 0.0;
  for (Index i = n - 1; i-- > 0;) {
    potential += 1.0 / path[static_cast<std::size_t>(i)].weight;
    EXPECT_NEAR(b[static_cast<std::size_t>(i)] / potential, 1.0, 1e-13) << i;
  }
}

TEST(LaplacianFactor, solves_a_random_graph) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const Index n = 60;
  std::vector<Coupling> graph;
  for (Index i = 0; i < n; ++i) {
    for (Index j = i + 1; j < n; ++j) {
      if (j == i + 1 || uniform(random) < 0.1) graph.push_back({i, j, uniform(random) + 0.01});
    }
  }
  LaplacianFactor factor;
  ExecutionContext context;
  ASSERT_TRUE(factor.factorize(n, graph, context));
  std::vector<double> x(static_cast<std::size_t>(n));
  for (double& value : x) value = uniform(random) - 0.5;
  x.back() = 0.0;
  std::vector<double> b(x.size(), 0.0);
  for (const Coupling& c : graph) {
    const double flow =
        c.weight * (x[static_cast<std::size_t>(c.low)] - x[static_cast<std::size_t>(c.high)]);
    b[static_cast<std::size_t>(c.low)] += flow;
    b[static_cast<std::size_t>(c.high)] -= flow;
  }
  factor.solve(b, context);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(b[i], x[i], 1e-12);
}

// A pair joined by 1e45 beside couplings of 1: what flows between its ends is a difference of
// potentials at their 45th place, which doubles do not hold and rounded shares of the pivots spoil.
TEST(LaplacianFactor, balances_the_flow_through_a_coupling_forty_five_orders_heavier) {
  const Index n = 5;
  const std::vector<Coupling> graph = {{0, 1, 1e45}, {0, 2, 1.0}, {0, 3, 3.0}, {1, 2, 7.0},
                                       {1, 3, 0.3},  {2, 3, 0.7}, {2, 4, 1.1}, {3, 4, 2.3}};
  LaplacianFactor factor;
  ExecutionContext context;
  ASSERT_TRUE(factor.factorize(n, graph, context));
  using Number = BigFloat<16>;
  const double force[] = {23.1, -22.9, 0.4, -0.1};
  std::vector<Number> x;
  for (const double f : force) x.emplace_back(f, 256);
  x.emplace_back(0.0, 256);
  factor.solve(x, context);
  std::vector<double> left(force, force + 4);
  left.push_back(0.0);
  for (const Coupling& c : graph) {
    const double flow =
        c.weight *
        (x[static_cast<std::size_t>(c.low)] - x[static_cast<std::size_t>(c.high)]).to_double();
    left[static_cast<std::size_t>(c.low)] -= flow;
    left[static_cast<std::size_t>(c.high)] += flow;
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(left[i], 0.0, 1e-13) << i;
}

TEST(LaplacianFactor, says_when_a_vertex_is_not_connected_to_the_fixed_one) {
  LaplacianFactor factor;
  ExecutionContext context;
  EXPECT_FALSE(factor.factorize(4, {{0, 1, 1.0}, {2, 3, 1.0}}, context));
}

}  // namespace
}  // namespace flipfree::numeric::laplacian_factor_test
