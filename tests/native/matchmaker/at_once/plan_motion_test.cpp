#include "flipfree/matchmaker/at_once/plan_motion.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flipfree::matchmaker::plan_motion_test {
namespace {

struct Task {
  Polygon rim;
  std::vector<Vector2> from, to;
};

// Pins on a spiral go to places on another one.
Task spirals() {
  Task task;
  for (int i = 0; i < 12; ++i)
    task.rim.emplace_back(std::cos(i * M_PI / 6), std::sin(i * M_PI / 6));
  for (int i = 0; i < 14; ++i) {
    const double r = 0.85 * std::sqrt((i + 0.5) / 14);
    task.from.emplace_back(r * std::cos(2.4 * i), r * std::sin(2.4 * i));
    const int k = (5 * i + 3) % 14;
    const double s = 0.8 * std::sqrt((k + 0.5) / 14);
    task.to.emplace_back(s * std::cos(1.0 + 2.4 * k), s * std::sin(1.0 + 2.4 * k));
  }
  return task;
}

std::int64_t complexity(const Task& task, const std::vector<PinMove>& moves) {
  MovingPins pins(task.rim, task.from);
  for (const PinMove& m : moves) EXPECT_TRUE(pins.move(m.pin, m.to));
  for (std::size_t i = 0; i < task.to.size(); ++i)
    EXPECT_EQ(pins.place(static_cast<VertexId>(i)), task.to[i]);
  return pins.complexity();
}

TEST(PlanMotion, CrossesFarLessThanPinsThatGoStraightOneAfterAnother) {
  const Task task = spirals();
  std::vector<PinMove> straight;
  for (std::size_t i = 0; i < task.to.size(); ++i)
    straight.push_back({static_cast<VertexId>(i), task.to[i]});
  ExecutionContext context;
  const std::vector<PinMove> planned = plan_motion(task.rim, task.from, task.to, context);
  EXPECT_LT(2 * complexity(task, planned), complexity(task, straight));
}

TEST(PlanMotion, IsTheSameForAnyNumberOfThreads) {
  const Task task = spirals();
  ExecutionContext one;
  one.threads = 1;
  ExecutionContext three;
  three.threads = 3;
  const auto a = plan_motion(task.rim, task.from, task.to, one);
  const auto b = plan_motion(task.rim, task.from, task.to, three);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].pin, b[i].pin);
    EXPECT_EQ(a[i].to, b[i].to);
  }
}

}  // namespace
}  // namespace flipfree::matchmaker::plan_motion_test
