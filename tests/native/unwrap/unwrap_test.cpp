#include "flipfree/unwrap/unwrap.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "support/shapes.h"

namespace flipfree {
namespace {

TEST(Unwrap, the_progress_bar_is_full_only_at_the_end) {
  const Surface surface = test::sphere(40, 30);
  ExecutionContext context;
  std::atomic<bool> ended{false};
  std::atomic<bool> too_early{false};
  std::thread watcher([&] {
    while (!ended) {
      // In this order: the stage "done" is named before the fraction becomes 1.
      const bool full = context.fraction() == 1.0;
      if (full && std::strcmp(context.stage(), "done") != 0) too_early = true;
    }
  });
  const Parametrization map = unwrap(surface, {}, context);
  ended = true;
  watcher.join();
  EXPECT_FALSE(too_early);
  EXPECT_EQ(context.fraction(), 1.0);
  EXPECT_TRUE(map.certificate.ok);
}

}  // namespace
}  // namespace flipfree
