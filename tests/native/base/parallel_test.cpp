#include "flipfree/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <initializer_list>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "flipfree/base/error.h"

namespace flipfree::parallel_test {
namespace {

TEST(ParallelFor, chunks_are_those_of_the_grain_whatever_the_number_of_threads) {
  for (const std::size_t count : std::initializer_list<std::size_t>{0, 1, 6, 7, 8, 50}) {
    for (const std::size_t grain : std::initializer_list<std::size_t>{1, 7, 100}) {
      for (const int threads : {-1, 0, 1, 3}) {
        ExecutionContext context;
        context.threads = threads;
        std::mutex mutex;
        std::set<std::vector<std::size_t>> seen;
        parallel_for(context, count, grain,
                     [&](std::size_t begin, std::size_t end, std::size_t chunk) {
                       const std::scoped_lock lock(mutex);
                       EXPECT_TRUE(seen.insert({chunk, begin, end}).second);
                     });
        std::set<std::vector<std::size_t>> expected;
        for (std::size_t i = 0; i < count; ++i) {
          if (i % grain == 0) expected.insert({i / grain, i, std::min(count, i + grain)});
        }
        EXPECT_EQ(seen, expected);
        EXPECT_EQ(chunk_count(count, grain), expected.size());
      }
    }
  }
}

TEST(ParallelFor, of_several_chunks_that_throw_the_first_one_is_heard) {
  // Chunks 1 and 0 both throw, 1 first: 0 waits for it.
  ExecutionContext context;
  context.threads = 2;
  std::atomic<bool> thrown{false};
  try {
    parallel_for(context, 2, 1, [&](std::size_t, std::size_t, std::size_t chunk) {
      if (chunk == 0) {
        while (!thrown) std::this_thread::yield();
      } else {
        thrown = true;
      }
      throw_invalid(ErrorCode::kBadOption, std::to_string(chunk));
    });
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().message, "0");
  }
}

TEST(ParallelFor, what_did_not_start_when_a_chunk_threw_is_dropped) {
  ExecutionContext context;
  context.threads = 1;
  std::size_t last = 0;
  EXPECT_THROW(parallel_for(context, 100, 1,
                            [&](std::size_t, std::size_t, std::size_t chunk) {
                              last = chunk;
                              if (chunk == 4) throw_invalid(ErrorCode::kBadOption, "");
                            }),
               InvalidInput);
  EXPECT_EQ(last, 4U);
}

TEST(ParallelFor, sums_per_chunk_have_the_same_bits_for_any_number_of_threads) {
  const auto sum = [](int threads) {
    ExecutionContext context;
    context.threads = threads;
    std::vector<double> partial(chunk_count(100000, 64), 0.0);
    parallel_for(context, 100000, 64, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
      for (std::size_t i = begin; i < end; ++i)
        partial[chunk] += 1.0 / (1.0 + static_cast<double>(i));
    });
    double total = 0.0;
    for (const double p : partial) total += p;
    return total;
  };
  EXPECT_EQ(sum(1), sum(2));
  EXPECT_EQ(sum(1), sum(4));
}

TEST(ParallelFor, stops_when_cancelled_and_the_context_of_another_call_still_works) {
  ExecutionContext context;
  std::atomic<int> visits{0};
  EXPECT_THROW(parallel_for(context, 100000, 1,
                            [&](std::size_t, std::size_t, std::size_t) {
                              if (++visits == 10) context.cancel();
                            }),
               Cancelled);
  EXPECT_LT(visits.load(), 1000);
  ExecutionContext fresh;
  EXPECT_NO_THROW(parallel_for(fresh, 10, 1, [](std::size_t, std::size_t, std::size_t) {}));
}

}  // namespace
}  // namespace flipfree::parallel_test
