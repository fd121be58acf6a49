// CPU seconds of this thread, for tests of how cost grows.
#pragma once

#include <ctime>

namespace flipfree::test {

inline double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace flipfree::test
