#include "flipfree/base/threads/work_meter.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <stdexcept>
#include <thread>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/parallel.h"

namespace flipfree::work_meter_test {
namespace {

// A context with a meter whose clock goes on only where the test says so.
struct Measured {
  double time = 0.0;
  WorkMeter meter{[this] { return time; }};
  ExecutionContext context;

  Measured() {
    context.meter = &meter;
    context.threads = 4;
  }
  void chunks(const ExecutionContext& own, const std::vector<double>& seconds) {
    parallel_for(own, seconds.size(), 1,
                 [&](std::size_t begin, std::size_t, std::size_t) { time += seconds[begin]; });
  }
  WorkMeter::Seconds seconds() {
    WorkMeter::Seconds sum{};
    for (const WorkMeter::Stage& stage : meter.stages()) {
      for (std::size_t kind = 0; kind < sum.size(); ++kind) sum[kind] += stage.seconds[kind];
    }
    return sum;
  }
};

using Seconds = WorkMeter::Seconds;

TEST(WorkMeter, what_is_outside_of_loops_takes_as_long_on_any_number_of_cores) {
  Measured of;
  of.time += 3.0;
  EXPECT_EQ(of.seconds(), (Seconds{3, 3, 3, 3, 3, 3}));
  EXPECT_EQ(of.meter.stages().front().serial, 3.0);
}

TEST(WorkMeter, chunks_go_in_order_to_the_core_that_is_free_first) {
  Measured of;
  of.chunks(of.context, {1, 1, 1, 5, 1, 1});
  // Two cores: 5 beside all others would be best; dealt in order, 1 5 comes beside 1 1 1 1.
  EXPECT_EQ(of.seconds(), (Seconds{10, 6, 5, 5, 5, 5}));
  EXPECT_EQ(of.meter.stages().front().serial, 0.0);
  EXPECT_EQ(of.meter.stages().front().loops, 1U);
}

TEST(WorkMeter, loops_inside_of_loops_share_the_cores_that_are_left) {
  Measured of;
  parallel_for(of.context, 2, 1, [&](std::size_t, std::size_t, std::size_t) {
    of.time += 1.0;
    of.chunks(of.context, {1, 1, 1, 1});
  });
  // Two chunks of 5 on one core each, 3 on two each, 2 on four each.
  EXPECT_EQ(of.seconds(), (Seconds{10, 5, 3, 2, 2, 2}));
}

TEST(WorkMeter, a_part_that_has_one_thread_is_serial) {
  Measured of;
  parallel_for(of.context, 2, 1, [&](std::size_t, std::size_t, std::size_t) {
    const ExecutionContext part(&of.context, 1);
    of.chunks(part, {1, 1});
  });
  EXPECT_EQ(of.seconds(), (Seconds{4, 2, 2, 2, 2, 2}));
}

TEST(WorkMeter, seconds_belong_to_the_stage_that_was_reported) {
  Measured of;
  of.context.report("first", 0.0);
  of.time += 1.0;
  of.context.report("second", 0.5);
  of.chunks(of.context, {2, 2});
  of.context.report("first", 0.6);
  of.time += 4.0;
  const std::vector<WorkMeter::Stage>& stages = of.meter.stages();
  ASSERT_EQ(stages.size(), 3U);
  EXPECT_STREQ(stages[1].name, "first");
  EXPECT_EQ(stages[1].seconds, (Seconds{5, 5, 5, 5, 5, 5}));
  EXPECT_EQ(stages[2].seconds, (Seconds{4, 2, 2, 2, 2, 2}));
}

TEST(WorkMeter, a_chunk_that_throws_ends_its_loop_and_nothing_else) {
  Measured of;
  EXPECT_THROW(parallel_for(of.context, 2, 1,
                            [&](std::size_t, std::size_t, std::size_t) {
                              of.time += 1.0;
                              throw std::runtime_error("");
                            }),
               std::runtime_error);
  of.time += 1.0;
  EXPECT_EQ(of.seconds()[1], 1.0);  // the chunk did not end
}

TEST(WorkMeter, everything_runs_on_the_callers_thread_in_order) {
  Measured of;
  std::vector<std::size_t> order;
  const std::thread::id caller = std::this_thread::get_id();
  parallel_for(of.context, 10, 3, [&](std::size_t begin, std::size_t, std::size_t) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    order.push_back(begin);
  });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 3, 6, 9}));
}

TEST(WorkMeter, the_clock_counts_what_this_thread_computes) {
  const double before = thread_seconds();
  while (thread_seconds() < before + 1e-3) {
  }
  double other = 0.0;
  std::thread([&other] { other = thread_seconds(); }).join();
  EXPECT_LT(other, thread_seconds());
}

}  // namespace
}  // namespace flipfree::work_meter_test
