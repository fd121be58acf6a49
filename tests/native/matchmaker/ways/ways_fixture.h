// A problem for the ways to a map, and what their solutions must show.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>

#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_map.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::test {

class WaysFixture : public testing::Test {
 protected:
  WaysFixture()
      : surface_(bumpy_grid(10, 10, 0.1, 2)), refined_(mesh::make_refined_surface(surface_)) {}

  // An outline around the origin, at a distance that depends on the direction.
  template <typename Radius>
  void hold_boundary(const Radius& radius) {
    const auto n = static_cast<double>(refined_.boundary.size());
    for (std::size_t i = 0; i < refined_.boundary.size(); ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / n;
      constraints_.outline.emplace_back(radius(angle) * std::cos(angle),
                                        radius(angle) * std::sin(angle));
    }
  }
  void hold_circle() {
    hold_boundary([](double) { return 1.0; });
  }
  // A leaf of three lobes, which is not convex.
  void hold_leaf() {
    hold_boundary([](double angle) { return 1 + 0.4 * std::cos(3 * angle); });
  }

  matchmaker::Problem problem() { return {refined_, constraints_, options_}; }

  // The solution, after it was seen to be valid, with exact provenance, and to meet all constraints
  // bit for bit.
  matchmaker::Solution meets(matchmaker::Solution solution) {
    expect_arrived(solution.map, constraints_);
    EXPECT_EQ(mesh::find_broken_invariant(solution.map.surface), "");
    return solution;
  }
  // The same of a way that may fail.
  matchmaker::Solution meets(std::optional<matchmaker::Solution> solution) {
    EXPECT_TRUE(solution.has_value());
    return solution ? meets(std::move(*solution)) : matchmaker::Solution{};
  }

  // A pin for vertex (i, j) of the grid's 11 x 11.
  void pin(Index i, Index j, const Vector2& uv) { constraints_.pins.push_back({11 * j + i, uv}); }

  mesh::Surface surface_;
  mesh::RefinedSurface refined_;
  matchmaker::Constraints constraints_;
  matchmaker::MatchOptions options_;
  ExecutionContext context_;
  Stats stats_;
};

}  // namespace flipfree::test
