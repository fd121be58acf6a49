#include "flipfree/base/failure.h"

#include <gtest/gtest.h>

namespace flipfree::in_time_test {
namespace {

// A clock that goes on by one second at every look at it.
void tick(ExecutionContext& context) {
  context.clock = [now = 0.0]() mutable { return now += 1.0; };
}

TEST(InTime, ALimitOfItsOwnIsNamedAndOneAroundItGoesOn) {
  ExecutionContext context;
  tick(context);
  const auto endless = [&]() -> int {
    while (true) context.check();
  };
  EXPECT_EQ(in_time(context, 3, "It", "or less", [] { return 5; }), 5);
  try {
    in_time(context, 3, "It was not found", "or ask for less", endless);
    FAIL() << "went on";
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kTimeLimit);
    EXPECT_NE(e.error().message.find("It was not found"), std::string::npos);
    EXPECT_NE(e.error().message.find("max_seconds = 3"), std::string::npos);
  }
  const TimeLimit all(context, 5);
  EXPECT_THROW(in_time(context, 0, "It", "or less", endless), TimeIsOver);
}

}  // namespace
}  // namespace flipfree::in_time_test
