// Memory that is not there: every allocation of this program that the C++ code makes (operator new,
// and malloc, calloc, realloc, posix_memalign, aligned_alloc as Eigen calls them) is counted and
// can be made to fail.
//
// The operators are replaced; calls to the C functions are redirected by the linker (--wrap, see
// CMakeLists.txt), in our code and in all that is compiled into it. Not covered: what shared
// libraries allocate for themselves (GMP and MPFR, which end the process when they get nothing;
// the C library's thread stacks).
#pragma once

#include <cstdint>
#include <vector>

namespace flipfree::test {

// While it lives, allocation number `at` (from 1 on, of all threads) fails, and if `and_all_later`
// so does every later one. at = 0: none fails. One at a time.
class FailingAllocations {
 public:
  explicit FailingAllocations(std::int64_t at, bool and_all_later = false);
  ~FailingAllocations();
  FailingAllocations(const FailingAllocations&) = delete;
  FailingAllocations& operator=(const FailingAllocations&) = delete;

  // Allocations since the construction, the failed ones included.
  std::int64_t count() const;
};

// While it lives, notes from where allocations are made, on the thread that made it. A call repeats
// the same thing thousands of times; what makes a difference is who asked.
class AllocationPlaces {
 public:
  AllocationPlaces();
  ~AllocationPlaces();
  AllocationPlaces(const AllocationPlaces&) = delete;
  AllocationPlaces& operator=(const AllocationPlaces&) = delete;

  // Numbers (as FailingAllocations counts) of the first and the last allocation of each place, a
  // place being the innermost frames of the stack; ascending.
  std::vector<std::int64_t> numbers() const;
};

// Blocks that were allocated and not freed, since the program began.
std::int64_t live_blocks();

}  // namespace flipfree::test
