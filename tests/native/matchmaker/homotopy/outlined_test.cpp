#include "flipfree/matchmaker/homotopy/move_outline.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <variant>

#include "flipfree/base/error.h"
#include "matchmaker/ways/ways_fixture.h"

namespace flipfree::matchmaker::outlined_test {
namespace {

class Outlined : public test::WaysFixture {};

TEST_F(Outlined, AHomotopyBringsTheOutlineAndThenThePins) {
  hold_leaf();
  pin(5, 5, {0.1, 0.05});
  const Solution solution = meets(by_homotopy(problem(), 1.0, context_, stats_));
  EXPECT_EQ(solution.engine, "homotopy");
  EXPECT_EQ(solution.keep, surface_.vertices.rows());
  EXPECT_GT(std::get<std::int64_t>(stats_.at("outline.frames")), 0);
}

TEST_F(Outlined, IsGivenUpWhenItsShareOfTheTimeIsOver) {
  hold_leaf();
  const TimeLimit limit(context_, 1e6);
  EXPECT_THROW(by_homotopy(problem(), 1e-15, context_, stats_), TimeIsOver);
  EXPECT_FALSE(context_.time_is_over()) << "there is time left for other ways";
}

}  // namespace
}  // namespace flipfree::matchmaker::outlined_test
