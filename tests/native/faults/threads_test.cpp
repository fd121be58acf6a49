// Threads that the system does not give: the work is done by those there are, to the same bits.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "faults/calls.h"

namespace {

std::atomic<int> to_be_given{-1};  // threads, before there are no more; negative: any number
std::atomic<int> refused{0};

}  // namespace

// std::thread's start, redirected by the linker (CMakeLists.txt).
using ThreadState = std::unique_ptr<std::thread::_State>;
void real_start(std::thread* self, ThreadState state, void (*depend)()) asm(
    "__real__ZNSt6thread15_M_start_threadESt10unique_ptrINS_6_StateESt14default_deleteIS1_EEPFvvE");
void start(std::thread* self, ThreadState state, void (*depend)()) asm(
    "__wrap__ZNSt6thread15_M_start_threadESt10unique_ptrINS_6_StateESt14default_deleteIS1_EEPFvvE");
void start(std::thread* self, ThreadState state, void (*depend)()) {
  if (to_be_given == 0) {
    ++refused;
    throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
  }
  if (to_be_given > 0) --to_be_given;
  real_start(self, std::move(state), depend);
}

namespace flipfree::test::threads_test {
namespace {

// Threads that live (base/context.h) are not asked for again: none may at the start.
TEST(Threads, that_are_not_given_are_done_without) {
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  const std::vector<Call> calls = all_calls();
  std::vector<std::string> expected;
  for (const Call& call : calls) expected.push_back(result_of(call, 1));
  int without = 0;
  for (const int given : {0, 1, 2}) {
    for (std::size_t i = 0; i < calls.size(); ++i) {
      to_be_given = given;
      refused = 0;
      const std::string bytes = result_of(calls[i], 4);
      to_be_given = -1;
      EXPECT_TRUE(bytes == expected[i]) << calls[i].name << ", " << given << " threads";
      without += refused > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(without, 0);
}

}  // namespace
}  // namespace flipfree::test::threads_test
