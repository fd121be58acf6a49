#include "flipfree/matchmaker/ways/solve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/base/error.h"
#include "matchmaker/ways/ways_fixture.h"

namespace flipfree::matchmaker::solve_test {
namespace {

class Ways : public test::WaysFixture {
 protected:
  Solution solved(MatchEngine engine) {
    options_.engine = engine;
    return meets(solve(problem(), context_, stats_));
  }
};

TEST_F(Ways, ThatAreAskedForByNameMakeTheMap) {
  hold_boundary([](double angle) { return 1 + 0.4 * std::cos(3 * angle); });
  EXPECT_EQ(solved(MatchEngine::kFirstTry).engine, "first try");
  EXPECT_EQ(solved(MatchEngine::kOutline).engine, "homotopy");
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
  options_.engine = MatchEngine::kArms;
  EXPECT_THROW(solve(problem(), context_, stats_), NotConverged);
}

TEST_F(Ways, WhatNoDiskHasIsRefusedBeforeAnyWork) {
  hold_boundary([](double) { return 1.0; });
  constraints_.simple_outline = false;  // as the reader says of outlines that meet themselves
  constraints_.pins = {{60, {3.0, 0.0}}};
  EXPECT_THROW(solve(problem(), context_, stats_), Infeasible);
  EXPECT_TRUE(stats_.empty());
}

}  // namespace
}  // namespace flipfree::matchmaker::solve_test
