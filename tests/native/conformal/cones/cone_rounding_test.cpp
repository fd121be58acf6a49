#include "flipfree/conformal/suggest_cones.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "conformal/engine_inputs.h"

namespace flipfree::conformal::cone_rounding_test {
namespace {

constexpr double kQuarter = std::numbers::pi / 2;

int total(const ConeSteps& cones) {
  int sum = 0;
  for (const auto& [v, steps] : cones) sum += steps;
  return sum;
}

std::vector<double> flat(const mesh::Surface& surface) {
  return std::vector<double>(static_cast<std::size_t>(surface.vertices.rows()),
                             2 * std::numbers::pi);
}

TEST(RoundCones, WholeQuantaStayAsTheyAre) {
  const mesh::Surface surface = test::sphere(12, 9);
  std::vector<double> angles = flat(surface);
  angles[10] -= kQuarter;
  angles[30] -= 3 * kQuarter;
  angles[60] += 2 * kQuarter;
  const ConeSteps expected{{10, 1}, {30, 3}, {60, -2}};
  EXPECT_EQ(round_cones(surface, angles, {10, 30, 60}, kQuarter, 3), expected);
}

TEST(RoundCones, WhatRoundingLeavesGoesToOtherCones) {
  const mesh::Surface surface = test::sphere(12, 9);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 30; ++trial) {
    std::vector<VertexId> cones;
    for (VertexId v = 3; v < surface.vertices.rows(); v += 7) cones.push_back(v);
    // Curvatures that add up to two full turns.
    std::vector<double> share(cones.size());
    double sum = 0.0;
    for (double& s : share) sum += s = unit(random) - 0.2;
    std::vector<double> angles = flat(surface);
    for (std::size_t i = 0; i < cones.size(); ++i)
      angles[static_cast<std::size_t>(cones[i])] -= 4 * std::numbers::pi * share[i] / sum;
    const ConeSteps rounded = round_cones(surface, angles, cones, kQuarter, 3);
    EXPECT_EQ(total(rounded), 8);
    for (const auto& [v, steps] : rounded) {
      EXPECT_NE(steps, 0);
      EXPECT_LE(steps, 3);
      EXPECT_NE(std::find(cones.begin(), cones.end(), v), cones.end());
    }
  }
}

// Cones of a quarter turn against the linear model's own word.
class SearchCones : public testing::Test {
 protected:
  SearchCones() : surface_(test::sphere(20, 15)) {
    EngineInput input = test::flat_but_one(surface_, 0);
    input.target = flat(surface_);
    const auto engine = make_double_engine(input, context_);
    Gradient gradient;
    engine->evaluate(1e-13, gradient, context_);
    curvature_ = gradient.value;
    std::vector<char> base(curvature_.size(), 0);
    base[0] = 1;
    linear_.emplace(engine->mesh(), gradient, base, context_);
    search_.quantum = kQuarter;
    search_.balanced = true;
    search_.fixed.assign(curvature_.size(), 0);
  }
  TrueScale measured(const ConeSteps& cones) {
    ++measurements_;
    std::vector<double> u(curvature_.size(), 0.0);
    const auto add = [&](VertexId v, double charge) {
      const std::vector<double> response = linear_->response(v, context_);
      for (std::size_t w = 0; w < u.size(); ++w) u[w] += charge * response[w];
    };
    if (bare_.empty()) {
      for (std::size_t v = 1; v < curvature_.size(); ++v)
        add(static_cast<VertexId>(v), -curvature_[v]);
      bare_ = u;
    } else {
      u = bare_;
    }
    for (const auto& [v, steps] : cones)
      if (v != 0) add(v, steps * kQuarter);
    const auto [low, high] = std::minmax_element(u.begin(), u.end());
    const double range = *high - *low;
    return {std::move(u), range};
  }
  FoundCones found(const ConeSteps& start) {
    return search_cones(
        surface_, *linear_, search_, start, [&](const ConeSteps& c) { return measured(c); },
        context_);
  }

  ExecutionContext context_;
  mesh::Surface surface_;
  std::vector<double> curvature_;
  std::vector<double> bare_;
  std::optional<LinearPlacement> linear_;
  ConeSearch search_;
  int measurements_ = 0;
};

TEST_F(SearchCones, ExchangesQuantaUntilTheRangeIsAllowed) {
  const ConeSteps start{{40, 3}, {41, 3}, {42, 2}};  // all on one side
  const double before = measured(start).range;
  search_.allowed = 0.5 * before;
  const FoundCones result = found(start);
  EXPECT_LE(result.range, search_.allowed);
  EXPECT_EQ(total(result.cones), 8) << "what one gives away another receives";
  EXPECT_NEAR(measured(result.cones).range, result.range, 1e-12);
  for (const auto& [v, steps] : result.cones) EXPECT_LE(steps, search_.most_steps);
}

TEST_F(SearchCones, IsContentWithAStartThatIsAllowed) {
  const ConeSteps start{{40, 3}, {150, 3}, {220, 2}};
  search_.allowed = 2 * measured(start).range;
  measurements_ = 0;
  EXPECT_EQ(found(start).cones, start);
  EXPECT_EQ(measurements_, 1);
}

TEST_F(SearchCones, LeavesVerticesAloneThatAreFixed) {
  search_.fixed.assign(curvature_.size(), 1);
  const ConeSteps start{{40, 3}, {41, 3}, {42, 2}};
  search_.allowed = 1e-3;
  EXPECT_EQ(found(start).cones, start);
}

}  // namespace
}  // namespace flipfree::conformal::cone_rounding_test
