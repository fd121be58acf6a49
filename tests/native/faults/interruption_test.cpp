// Calls that are cancelled, accepted or out of time at any moment: they end soon, with our own
// exception or a valid result, and the next one has the same bits as if nothing had been.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <string>
#include <vector>

#include "faults/calls.h"
#include "faults/samples.h"
#include "flipfree/base/error.h"

namespace flipfree::test::interruption_test {
namespace {

constexpr double kLongTime = 1e9;  // seconds: the clock is asked, time is never over by itself

enum class Outcome { kResult, kCancelled, kTimeLimit, kAnother };

// Runs the call; anything but a valid result, Cancelled and the time limit is a failure. Nothing
// else may be said of meshes that are solved without an interruption.
Outcome outcome_of(const Call& call, ExecutionContext& context, double max_seconds) {
  try {
    call.run(context, max_seconds);
    return Outcome::kResult;
  } catch (const Cancelled&) {
    return Outcome::kCancelled;
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kTimeLimit) << call.name << ": " << e.what();
    return Outcome::kTimeLimit;
  } catch (const std::exception& e) {
    ADD_FAILURE() << call.name << ": " << e.what();
  }
  return Outcome::kAnother;
}

// A clock that stands still, and says when it is asked for the n-th time.
struct CountingClock {
  std::atomic<std::int64_t> asked{0};
  std::int64_t at = -1;
  double jump = 0;  // seconds, from the moment on
  // What becomes of the call with this clock, on one thread.
  Outcome outcome_of(const Call& call, void (ExecutionContext::*at_the_moment)() = nullptr) {
    ExecutionContext context;
    context.threads = 1;
    context.clock = [&, at_the_moment] {
      const std::int64_t n = ++asked;
      if (n == at && at_the_moment != nullptr) (context.*at_the_moment)();
      return at >= 0 && n >= at ? jump : 0.0;
    };
    return interruption_test::outcome_of(call, context, kLongTime);
  }
};

class Interruption : public testing::TestWithParam<Call> {};

TEST_P(Interruption, may_come_at_any_check) {
  const Call& call = GetParam();
  const std::string expected = result_of(call, 2);
  CountingClock whole;
  whole.outcome_of(call);
  ASSERT_GT(whole.asked, 2);
  int cancelled = 0;
  int limited = 0;
  for (const std::int64_t at : spread(whole.asked, sample_count(25))) {
    const Outcome stopped = CountingClock{.at = at}.outcome_of(call, &ExecutionContext::cancel);
    EXPECT_NE(stopped, Outcome::kTimeLimit);
    cancelled += stopped == Outcome::kCancelled ? 1 : 0;
    EXPECT_EQ(CountingClock{.at = at}.outcome_of(call, &ExecutionContext::accept),
              Outcome::kResult);
    // All time is over, or only the share that one of several ways has of it.
    for (const double jump : {2.0, 0.95, 0.6}) {
      CountingClock late{.at = at, .jump = jump * kLongTime};
      const Outcome outcome = late.outcome_of(call);
      EXPECT_NE(outcome, Outcome::kCancelled);
      limited += outcome == Outcome::kTimeLimit ? 1 : 0;
    }
    ASSERT_TRUE(result_of(call, 2) == expected) << "after an interruption at check " << at;
  }
  EXPECT_GT(cancelled, 0);
  std::printf("%s: %lld checks, %d cancelled, %d out of time\n", call.name.c_str(),
              static_cast<long long>(whole.asked), cancelled, limited);
}

INSTANTIATE_TEST_SUITE_P(Calls, Interruption, testing::ValuesIn(all_calls()),
                         [](const auto& info) { return identifier(info.param.name); });

}  // namespace
}  // namespace flipfree::test::interruption_test
