#include "flipfree/base/failure.h"

#include <gtest/gtest.h>

namespace flipfree::give_up_test {
namespace {

// A clock that goes on by one second at every look at it.
void tick(ExecutionContext& context) {
  context.clock = [now = 0.0]() mutable { return now += 1.0; };
}

TEST(GiveUp, AWayThatRunsOutOfItsShareIsGivenUp) {
  ExecutionContext context;
  tick(context);
  const TimeLimit all(context, 1000);
  EXPECT_TRUE(ended_in_share(context, [&] { context.check(); }));
  EXPECT_FALSE(ended_in_share(context, [&] {
    const TimeLimit share(context, 3);
    while (true) context.check();
  }));
}

TEST(GiveUp, WhenAllTimeIsOverTheCallEnds) {
  ExecutionContext context;
  tick(context);
  const TimeLimit all(context, 5);
  const auto endless = [&] {
    while (true) context.check();
  };
  EXPECT_THROW(ended_in_share(context, endless), TimeIsOver);
  EXPECT_FALSE(ended_in_time(endless));
}

TEST(GiveUp, OfAPartAnInfeasibleIsNoProofForTheWhole) {
  const auto infeasible = []() -> int {
    throw_infeasible(ErrorCode::kNoRoomInPolygon, "Room.", {"area", {}});
  };
  EXPECT_THROW(attempt(infeasible), Infeasible);
  const Outcome<int> part = attempt_part(infeasible);
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().code, ErrorCode::kNoRoomInPolygon);
  EXPECT_EQ(*attempt_part([] { return 3; }), 3);
  EXPECT_THROW(attempt_part([]() -> int { throw TimeIsOver(); }), TimeIsOver);
}

TEST(GiveUp, OfAStepWithoutAValueIsItsFailure) {
  EXPECT_FALSE(failure_of([] {}));
  const std::optional<Error> failure =
      failure_of([] { throw_not_converged(ErrorCode::kIterationLimit, "Slow."); });
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->message, "Slow.");
  EXPECT_THROW(failure_of([] { throw Cancelled(); }), Cancelled);
}

}  // namespace
}  // namespace flipfree::give_up_test
