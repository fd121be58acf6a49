#include <gtest/gtest.h>
#ifndef _WIN32
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <atomic>
#include <chrono>
#include <functional>
#include <initializer_list>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"

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

// Threads that were inside one call at once; the caller waits until so many are there.
std::set<std::thread::id> together(std::size_t helpers) {
  std::mutex mutex;
  std::set<std::thread::id> seen;
  std::atomic<std::size_t> inside{0};
  work_together(helpers, [&] {
    {
      const std::scoped_lock lock(mutex);
      seen.insert(std::this_thread::get_id());
    }
    ++inside;
    while (inside < helpers + 1) std::this_thread::yield();
  });
  return seen;
}

TEST(WorkTogether, as_many_help_as_are_asked_for_whatever_the_machine_has) {
  for (const std::size_t helpers : {0U, 1U, 7U}) EXPECT_EQ(together(helpers).size(), helpers + 1);
}

TEST(WorkTogether, nobody_is_inside_any_more_when_it_returns) {
  for (int i = 0; i < 2000; ++i) {
    std::atomic<int> inside{0};
    work_together(4, [&] {
      ++inside;
      --inside;
    });
    ASSERT_EQ(inside.load(), 0);
  }
}

TEST(WorkTogether, calls_inside_calls_come_to_their_end) {
  std::atomic<int> leaves{0};
  const std::function<void(int)> grow = [&](int depth) {
    work_together(2, [&, depth] {
      if (depth == 0) {
        ++leaves;
      } else {
        grow(depth - 1);
      }
    });
  };
  grow(4);
  EXPECT_GE(leaves.load(), 1);
}

TEST(WorkTogether, calls_from_several_threads_come_to_their_end) {
  std::vector<std::jthread> callers;
  std::atomic<int> calls{0};
  for (int t = 0; t < 4; ++t) {
    callers.emplace_back([&] {
      for (int i = 0; i < 500; ++i) work_together(3, [&] { ++calls; });
    });
  }
  callers.clear();
  EXPECT_GE(calls.load(), 2000);
}

#ifndef _WIN32
// Whether it holds in a child of this process.
void expect_in_child(const std::function<bool()>& holds) {
  const pid_t child = ::fork();
  ASSERT_NE(child, -1);
  if (child == 0) ::_exit(holds() ? 0 : 1);
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(WorkTogether, a_forked_child_has_helpers_of_its_own) {
  EXPECT_EQ(together(2).size(), 3U);
  expect_in_child([] { return together(2).size() == 3; });
}

// In a child, so that the other tests find as few helpers as they ask for.
TEST(WorkTogether, never_more_than_the_blas_has_room_for) {
  expect_in_child([] {
    std::mutex mutex;
    std::set<std::thread::id> seen;
    work_together(5000, [&] {
      {
        const std::scoped_lock lock(mutex);
        seen.insert(std::this_thread::get_id());
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    });
    return seen.size() > 1 && seen.size() <= kMostThreads;
  });
}
#endif

}  // namespace
}  // namespace flipfree::parallel_test
