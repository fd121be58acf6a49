// Calls that are cancelled, accepted or out of time at any moment: they end soon, with our own
// exception or a valid result, and the next one has the same bits as if nothing had been.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "faults/calls.h"
#include "faults/samples.h"
#include "flipfree/base/error.h"

namespace flipfree::test::interruption_test {
namespace {

constexpr double kLongTime = 1e9;  // seconds: the clock is asked, time is never over by itself
constexpr double kLatest = 5.0;    // seconds that a call may come back late on a loaded machine

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

std::string result_of(const Call& call) {
  ExecutionContext context;
  return call.run(context, 0);
}

// A clock that stands still, and says when it is asked for the n-th time.
struct CountingClock {
  std::atomic<std::int64_t> asked{0};
  std::int64_t at = -1;
  double jump = 0;  // seconds, from the moment on
  void install(ExecutionContext& context, std::function<void()> at_the_moment = {}) {
    context.clock = [this, at_the_moment = std::move(at_the_moment)] {
      const std::int64_t n = ++asked;
      if (n == at && at_the_moment) at_the_moment();
      return at >= 0 && n >= at ? jump : 0.0;
    };
  }
};

class Interruption : public testing::TestWithParam<Call> {};

TEST_P(Interruption, may_come_at_any_check) {
  const Call& call = GetParam();
  const std::string expected = result_of(call);
  CountingClock whole;
  {
    ExecutionContext context;
    context.threads = 1;
    whole.install(context);
    outcome_of(call, context, kLongTime);
  }
  ASSERT_GT(whole.asked, 2);
  int cancelled = 0;
  int limited = 0;
  for (const std::int64_t at : spread(whole.asked, sample_count(25))) {
    {
      CountingClock clock;
      clock.at = at;
      ExecutionContext context;
      context.threads = 1;
      clock.install(context, [&] { context.cancel(); });
      const Outcome outcome = outcome_of(call, context, kLongTime);
      EXPECT_NE(outcome, Outcome::kTimeLimit);
      cancelled += outcome == Outcome::kCancelled ? 1 : 0;
    }
    // All time is over, or only the share that one of several ways has of it.
    for (const double jump : {2.0, 0.95, 0.6}) {
      CountingClock clock;
      clock.at = at;
      clock.jump = jump * kLongTime;
      ExecutionContext context;
      context.threads = 1;
      clock.install(context);
      const Outcome outcome = outcome_of(call, context, kLongTime);
      EXPECT_NE(outcome, Outcome::kCancelled);
      limited += outcome == Outcome::kTimeLimit ? 1 : 0;
    }
    ASSERT_TRUE(result_of(call) == expected) << "after an interruption at check " << at;
  }
  EXPECT_GT(cancelled, 0);
  std::printf("%s: %lld checks, %d cancelled, %d out of time\n", call.name.c_str(),
              static_cast<long long>(whole.asked), cancelled, limited);
}

INSTANTIATE_TEST_SUITE_P(Calls, Interruption, testing::ValuesIn(all_calls()),
                         [](const auto& info) { return identifier(info.param.name); });

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Where jobs can be accepted (context.h), does it.
template <typename Context>
void accept_if_possible(Context& context) {
  if constexpr (requires { context.accept(); }) context.accept();
}

// After `seconds`, on another thread, cancels or accepts; remembers when.
class LaterRequest {
 public:
  LaterRequest(ExecutionContext& context, double seconds, bool cancels)
      : thread_([this, &context, seconds, cancels] {
          const double due = now() + seconds;
          while (!ended_ && now() < due) std::this_thread::sleep_for(std::chrono::microseconds(50));
          if (ended_) return;
          at_ = now();
          if (cancels) {
            context.cancel();
          } else {
            accept_if_possible(context);
          }
        }) {}
  // Ends; the moment of the request, or 0 if there was none.
  double end() {
    ended_ = true;
    thread_.join();
    return at_;
  }

 private:
  std::atomic<bool> ended_{false};
  std::atomic<double> at_{0};
  std::thread thread_;
};

TEST(Interruptions, come_at_random_and_calls_end_soon) {
  const std::vector<Call> calls = all_calls();
  std::vector<std::string> expected;
  std::vector<double> seconds;
  for (const Call& call : calls) {
    const double begin = now();
    expected.push_back(result_of(call));
    seconds.push_back(now() - begin);
  }
  std::mt19937_64 random(13);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const int runs = sample_count(1000);
  int count[4] = {0, 0, 0, 0};
  double latest = 0;
  std::string latest_name;
  for (int run = 0; run < runs; ++run) {
    const std::size_t i = static_cast<std::size_t>(random() % calls.size());
    const Call& call = calls[i];
    ExecutionContext context;
    context.threads = 1 + static_cast<int>(random() % 3);
    const auto kind = random() % 4;  // a cancel, a cancel under a limit, a limit, an acceptance
    // Of a limit: from 1 ms to 10 s; every second one is where the call is likely to be at work.
    double limit = kind == 1 || kind == 2 ? std::pow(10.0, -3.0 + 4.0 * uniform()) : 0.0;
    if (kind == 2 && uniform() < 0.5) limit = 1.2 * seconds[i] * uniform() + 1e-6;
    const double begin = now();
    double requested = 0;
    Outcome outcome = Outcome::kAnother;
    if (kind == 2) {
      outcome = outcome_of(call, context, limit);
      requested = begin + limit;
    } else {
      LaterRequest request(context, 1.2 * seconds[i] * uniform(), kind != 3);
      outcome = outcome_of(call, context, limit);
      requested = request.end();
    }
    const double late = requested == 0 ? 0 : now() - requested;
    ++count[static_cast<int>(outcome)];
    EXPECT_LT(late, kLatest) << call.name;
    if (late > latest) {
      latest = late;
      latest_name = call.name;
    }
    if (run % 4 == 0) {
      ASSERT_TRUE(result_of(call) == expected[i]) << call.name;
    }
  }
  EXPECT_GT(count[static_cast<int>(Outcome::kCancelled)], runs / 20);
  EXPECT_GT(count[static_cast<int>(Outcome::kTimeLimit)], runs / 100);
  std::printf("%d runs: %d results, %d cancelled, %d out of time; %.3f s late at most (%s)\n", runs,
              count[0], count[1], count[2], latest, latest_name.c_str());
}

}  // namespace
}  // namespace flipfree::test::interruption_test
