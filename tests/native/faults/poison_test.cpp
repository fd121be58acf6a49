// A numerical step returns NaN, once or from then on: the call ends with our own exception or a
// certified result, and goes on forever in no case.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "faults/calls.h"
#include "faults/poison.h"
#include "faults/samples.h"
#include "flipfree/base/error.h"

namespace flipfree::test::poison_test {
namespace {

constexpr double kForeverSeconds = 60;  // a call of some milliseconds that lasts so long is endless

// Cancels the call when it is endless.
class Guard {
 public:
  explicit Guard(ExecutionContext& context)
      : thread_([this, &context] {
          for (int i = 0; i < kForeverSeconds * 1000 && !ended_; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
          if (!ended_) context.cancel();
        }) {}
  ~Guard() {
    ended_ = true;
    thread_.join();
  }
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;

 private:
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

enum class Outcome { kResult, kGaveUp, kAnother };

Outcome outcome_of(const Call& call, const std::string& what) {
  ExecutionContext context;
  context.threads = 1;
  const Guard guard(context);
  try {
    call.run(context, 0);
    return Outcome::kResult;
  } catch (const Cancelled&) {
    ADD_FAILURE() << what << ": endless";
  } catch (const Infeasible& e) {
    ADD_FAILURE() << what << ": called infeasible: " << e.what();
  } catch (const InvalidInput& e) {
    ADD_FAILURE() << what << ": blames the caller: " << e.what();
  } catch (const Exception&) {
    return Outcome::kGaveUp;
  } catch (const std::exception& e) {
    ADD_FAILURE() << what << ": " << e.what();
  }
  return Outcome::kAnother;
}

class PoisonedStep : public testing::TestWithParam<std::size_t> {};

TEST_P(PoisonedStep, ends_in_our_exception_or_a_certified_result) {
  const std::size_t step = GetParam();
  const std::string name = poisoned_steps()[step];
  int runs = 0;
  int reached = 0;
  int results = 0;
  int gave_up = 0;
  for (const Call& call : all_calls()) {
    std::int64_t total = 0;
    std::string expected;
    {
      const Poison counted(step, 0, false);
      expected = result_of(call, 1);
      total = counted.count();
    }
    if (total > 0) ++reached;
    for (const std::int64_t at : spread(total, sample_count(6))) {
      for (const bool and_all_later : {false, true}) {
        const std::string what = call.name + ", " + name + " " + std::to_string(at) +
                                 (and_all_later ? " and all later" : "");
        const Poison poison(step, at, and_all_later);
        const Outcome outcome = outcome_of(call, what);
        EXPECT_GT(poison.spoiled(), 0) << what;
        ++runs;
        results += outcome == Outcome::kResult ? 1 : 0;
        gave_up += outcome == Outcome::kGaveUp ? 1 : 0;
      }
    }
    EXPECT_TRUE(result_of(call, 1) == expected) << call.name << " afterwards";
  }
  EXPECT_GT(reached, 0) << "no call takes this step: is the symbol in poison.cpp still its name?";
  std::printf("%s: %d calls take it, %d runs, %d certified results, %d gave up\n", name.c_str(),
              reached, runs, results, gave_up);
}

INSTANTIATE_TEST_SUITE_P(Steps, PoisonedStep,
                         testing::Range(std::size_t{0}, poisoned_steps().size()),
                         [](const auto& info) { return identifier(poisoned_steps()[info.param]); });

}  // namespace
}  // namespace flipfree::test::poison_test
