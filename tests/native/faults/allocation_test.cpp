// Memory runs out at any place of any call: std::bad_alloc comes out, nothing is lost, and the same
// call gives the same bits afterwards.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "faults/calls.h"
#include "faults/failing_allocations.h"
#include "faults/samples.h"
#include "flipfree/base/error.h"

namespace flipfree::test::allocation_test {
namespace {

enum class Outcome { kResult, kNoMemory, kGaveUp };

// Runs the call with some allocations failing. InvalidInput and Infeasible blame the caller for
// what is no fault of theirs: they are failures of the test, as any foreign exception is.
Outcome outcome_of(const Call& call, int threads, std::int64_t at, bool and_all_later,
                   const std::string& expected) {
  try {
    const FailingAllocations failing(at, and_all_later);
    const std::string bytes = result_of(call, threads);
    EXPECT_TRUE(bytes == expected) << "another result, allocation " << at;
    return Outcome::kResult;
  } catch (const std::bad_alloc&) {
    return Outcome::kNoMemory;
  } catch (const NotConverged&) {
    return Outcome::kGaveUp;
  } catch (const std::exception& e) {
    ADD_FAILURE() << "allocation " << at << ": " << e.what();
  }
  return Outcome::kGaveUp;
}

// Up to `most` of the allocations by which the call's places differ, and a tenth as many of all.
std::vector<std::int64_t> chosen_allocations(const Call& call, int most, std::int64_t& total) {
  std::vector<std::int64_t> chosen;
  {
    const FailingAllocations counted(0);
    result_of(call, 1);
    total = counted.count();
  }
  {
    const AllocationPlaces places;
    result_of(call, 1);
    const std::vector<std::int64_t> numbers = places.numbers();
    for (const std::int64_t i : spread(static_cast<std::int64_t>(numbers.size()), most))
      chosen.push_back(numbers[static_cast<std::size_t>(i - 1)]);
  }
  for (const std::int64_t at : spread(total, most / 10)) chosen.push_back(at);
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

// Whether more blocks live than there may. Helping threads hold some until they have been idle for
// a second.
bool loses_blocks(std::int64_t most) {
  for (int tenths = 0; tenths < 50; ++tenths) {
    if (live_blocks() <= most) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return true;
}

class Allocation : public testing::TestWithParam<Call> {};

void every_failure_is_survived(const Call& call, int threads,
                               const std::vector<std::int64_t>& chosen) {
  const std::string expected = result_of(call, threads);
  int runs = 0;
  int count[3] = {0, 0, 0};
  for (const std::int64_t at : chosen) {
    for (const bool and_all_later : {false, true}) {
      const std::int64_t before = live_blocks();
      ++count[static_cast<int>(outcome_of(call, threads, at, and_all_later, expected))];
      EXPECT_FALSE(loses_blocks(before + call.may_lose_blocks)) << "a leak, allocation " << at;
      if (++runs % 16 == 0) {
        ASSERT_TRUE(result_of(call, threads) == expected) << "afterwards, allocation " << at;
      }
      if (testing::Test::HasFailure()) return;
    }
  }
  EXPECT_GT(count[static_cast<int>(Outcome::kNoMemory)], runs / 2);
  std::printf("%s, %d threads: %d runs, %d bad_alloc, %d results, %d gave up\n", call.name.c_str(),
              threads, runs, count[static_cast<int>(Outcome::kNoMemory)],
              count[static_cast<int>(Outcome::kResult)], count[static_cast<int>(Outcome::kGaveUp)]);
}

TEST_P(Allocation, any_may_fail_and_nothing_is_lost) {
  std::int64_t total = 0;
  const std::vector<std::int64_t> chosen = chosen_allocations(GetParam(), sample_count(150), total);
  std::printf("%lld allocations, %zu chosen\n", static_cast<long long>(total), chosen.size());
  every_failure_is_survived(GetParam(), 1, chosen);
}

TEST_P(Allocation, any_may_fail_on_any_thread) {
  std::int64_t total = 0;
  chosen_allocations(GetParam(), 1, total);
  every_failure_is_survived(GetParam(), 3, spread(total, sample_count(30)));
}

INSTANTIATE_TEST_SUITE_P(Calls, Allocation, testing::ValuesIn(all_calls()),
                         [](const auto& info) { return identifier(info.param.name); });

}  // namespace
}  // namespace flipfree::test::allocation_test
