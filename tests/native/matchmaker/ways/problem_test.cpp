#include "flipfree/matchmaker/ways/problem.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "matchmaker/ways/ways_fixture.h"

namespace flipfree::matchmaker::problem_test {
namespace {

class ProblemOfWays : public test::WaysFixture {};

TEST_F(ProblemOfWays, EachTargetIsMadeOnce) {
  hold_circle();
  Targets targets(refined_, constraints_);
  EXPECT_EQ(&targets.full(context_), &targets.full(context_));
  EXPECT_EQ(&targets.sheets(context_), &targets.sheets(context_));
}

TEST_F(ProblemOfWays, OverlapsWhereAnOutlineMeetsItselfOnly) {
  EXPECT_FALSE(problem().overlapping()) << "a free boundary is no outline";
  hold_circle();
  EXPECT_FALSE(problem().overlapping());
  constraints_.simple_outline = false;
  EXPECT_TRUE(problem().overlapping());
}

TEST_F(ProblemOfWays, LinesAreWholeUntilOneOfTheirEdgesIsSplit) {
  const VertexId a = 11 * 5 + 5;
  constraints_.edges = {{a, a + 1}, {a + 2, a + 1}};
  EXPECT_TRUE(lines_are_whole(refined_, constraints_));
  refined_.split_edge(refined_.mesh.find(a, a + 11));
  EXPECT_TRUE(lines_are_whole(refined_, constraints_));
  refined_.split_edge(refined_.mesh.find(a + 1, a + 2));
  EXPECT_FALSE(lines_are_whole(refined_, constraints_));
}

}  // namespace
}  // namespace flipfree::matchmaker::problem_test
