#include "flipfree/base/context.h"

#include <gtest/gtest.h>
#ifndef _WIN32
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace flipfree::helpers_test {
namespace {

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
TEST(WorkTogether, a_forked_child_has_helpers_of_its_own) {
  EXPECT_EQ(together(2).size(), 3U);
  const pid_t child = ::fork();
  ASSERT_NE(child, -1);
  if (child == 0) ::_exit(together(2).size() == 3 ? 0 : 1);
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

// In a child, so that the other tests find as few helpers as they ask for.
TEST(WorkTogether, never_more_than_the_blas_has_room_for) {
  const pid_t child = ::fork();
  ASSERT_NE(child, -1);
  if (child == 0) {
    std::mutex mutex;
    std::set<std::thread::id> seen;
    work_together(5000, [&] {
      {
        const std::scoped_lock lock(mutex);
        seen.insert(std::this_thread::get_id());
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    });
    ::_exit(seen.size() > 1 && seen.size() <= kMostThreads ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}
#endif

}  // namespace
}  // namespace flipfree::helpers_test
