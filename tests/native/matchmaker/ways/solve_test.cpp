#include "flipfree/matchmaker/ways/solve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker {
namespace {

class Ways : public testing::Test {
 protected:
  Ways()
      : surface_(test::bumpy_grid(10, 10, 0.1, 2)),
        refined_(mesh::make_refined_surface(surface_)) {}

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

  Solution solved(MatchEngine engine) {
    MatchOptions options;
    options.engine = engine;
    Targets targets(refined_, constraints_);
    Solution solution = solve({refined_, constraints_, options, targets}, context_, stats_);
    test::expect_valid(solution.map);
    for (const PinnedVertex& p : constraints_.pins)
      EXPECT_EQ(Vector2(solution.map.uv.row(p.vertex).transpose()), p.uv);
    return solution;
  }

  mesh::Surface surface_;
  mesh::RefinedSurface refined_;
  Constraints constraints_;
  ExecutionContext context_;
  Stats stats_;
};

TEST_F(Ways, ThatAreAskedForByNameMakeTheMap) {
  hold_boundary([](double angle) { return 1 + 0.4 * std::cos(3 * angle); });
  EXPECT_EQ(solved(MatchEngine::kFirstTry).engine, "first try");
  EXPECT_EQ(solved(MatchEngine::kOutline).engine, "film");
  EXPECT_EQ(solved(MatchEngine::kOverlay).engine, "film overlay");
  EXPECT_EQ(solved(MatchEngine::kMatchmaker).engine.substr(0, 10), "matchmaker");
}

TEST_F(Ways, LeaveTheProblemAsItWas) {
  hold_boundary([](double angle) { return 1 + 0.4 * std::cos(3 * angle); });
  const Triangles faces = refined_.mesh.faces();
  solved(MatchEngine::kAuto);
  EXPECT_EQ(refined_.mesh.faces(), faces) << "a way has split what the next would inherit";
}

TEST_F(Ways, ANamedWayThatIsNotForTheProblemLeavesItToTheGuarantee) {
  constraints_.pins = {{50, {0.5, 0.5}}, {70, {0.6, 0.5}}};
  EXPECT_EQ(solved(MatchEngine::kOutline).engine.substr(0, 10), "matchmaker");
}

TEST_F(Ways, ArmsRefuseWhatTheyAreNotFor) {
  constraints_.pins = {{50, {0.5, 0.5}}};
  MatchOptions options;
  options.engine = MatchEngine::kArms;
  Targets targets(refined_, constraints_);
  EXPECT_THROW(solve({refined_, constraints_, options, targets}, context_, stats_), NotConverged);
}

TEST_F(Ways, WhatNoDiskHasIsRefusedBeforeAnyWork) {
  hold_boundary([](double) { return 1.0; });
  constraints_.simple_outline = false;  // as the reader says of outlines that meet themselves
  constraints_.pins = {{60, {3.0, 0.0}}};
  MatchOptions options;
  Targets targets(refined_, constraints_);
  EXPECT_THROW(solve({refined_, constraints_, options, targets}, context_, stats_), Infeasible);
  EXPECT_TRUE(stats_.empty());
}

TEST_F(Ways, EachTargetIsMadeOnce) {
  hold_boundary([](double) { return 1.0; });
  Targets targets(refined_, constraints_);
  EXPECT_EQ(&targets.full(context_), &targets.full(context_));
  EXPECT_EQ(&targets.sheets(context_), &targets.sheets(context_));
}

}  // namespace
}  // namespace flipfree::matchmaker
