// Time that is over at any check: a call returns what it has, or says that there was no time, and
// leaves nothing behind. The clock is the tests' own: it counts how often it is asked.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/conformal/map.h"
#include "flipfree/conformal/suggest_cones.h"
#include "support/shapes.h"

namespace flipfree::conformal::time_limit_test {
namespace {

constexpr double kLimit = 1e6;  // seconds of the tests' clock

// Time stands still until the clock was asked `asked` times; then it is over.
struct Clock {
  std::atomic<long> calls{0};
  long asked = std::numeric_limits<long>::max();
  void install(ExecutionContext& context) {
    context.clock = [this] { return ++calls > asked ? 2 * kLimit : 0.0; };
  }
};

// Calls `work(context)` with time over after 0, 1, 2, ... asks of the clock, in `samples` growing
// steps up to where it needs none more. Everything but NotConverged (kTimeLimit) must be checked by
// `work` itself.
template <typename Work>
void with_every_limit(int samples, const Work& work) {
  Clock whole;
  {
    ExecutionContext context;
    whole.install(context);
    work(context);
  }
  const long total = whole.calls;
  ASSERT_GT(total, 10);
  int ended = 0;
  long asked = 0;
  for (int i = 0; i <= samples; ++i) {
    Clock clock;
    clock.asked = asked;
    ExecutionContext context;
    clock.install(context);
    try {
      work(context);
    } catch (const NotConverged& e) {
      EXPECT_EQ(e.error().code, ErrorCode::kTimeLimit) << asked << ": " << e.what();
      ++ended;
    }
    asked += 1 + total / samples;
  }
  EXPECT_GT(ended, samples / 8);
}

// A triangle so flat that its metric needs more bits than a double has.
mesh::Surface needle() {
  mesh::Surface s;
  s.vertices.resize(3, 3);
  s.vertices << 0, 0, 0, 1, 0, 0, 0.5, 1e-20, 0;
  s.faces.resize(1, 3);
  s.faces << 0, 1, 2;
  return s;
}

std::vector<double> flat_targets(const mesh::Surface& s) {
  // The angles of #F triangles, shared equally: far from those of the surface.
  return std::vector<double>(static_cast<std::size_t>(s.vertices.rows()),
                             std::numbers::pi * static_cast<double>(s.faces.rows()) /
                                 static_cast<double>(s.vertices.rows()));
}

void expect_metrics_to_end(const mesh::Surface& surface) {
  const std::vector<double> target = flat_targets(surface);
  MetricOptions options;
  options.max_seconds = kLimit;
  for (const bool refinement : {false, true}) {
    with_every_limit(120, [&](ExecutionContext& context) {
      const auto result =
          compute_refined_metric(surface, nullptr, target, options, refinement, context);
      EXPECT_TRUE(result.metric.converged);
      EXPECT_LE(result.metric.angle_error, options.tolerance);
    });
  }
}

TEST(TimeLimit, ends_a_metric_at_any_check) { expect_metrics_to_end(test::sphere(12, 9)); }

TEST(TimeLimit, ends_a_metric_of_many_bits_at_any_check) { expect_metrics_to_end(needle()); }

TEST(TimeLimit, returns_what_was_reached_where_that_is_wanted) {
  const mesh::Surface surface = test::sphere(12, 9);
  const std::vector<double> target = flat_targets(surface);
  MetricOptions options;
  options.max_seconds = kLimit;
  options.require_convergence = false;
  int partial = 0;
  const auto work = [&](ExecutionContext& context) {
    const auto metric =
        compute_refined_metric(surface, nullptr, target, options, false, context).metric;
    EXPECT_TRUE(std::isfinite(metric.angle_error));
    for (const double u : metric.scale_factors) EXPECT_TRUE(std::isfinite(u));
    EXPECT_EQ(metric.converged, metric.angle_error <= options.tolerance);
    partial += !metric.converged;
  };
  for (long asked = 1; asked < 4000; asked += 1 + asked / 16) {
    Clock clock;
    clock.asked = asked;
    ExecutionContext context;
    clock.install(context);
    try {
      work(context);
    } catch (const NotConverged& e) {
      EXPECT_EQ(e.error().code, ErrorCode::kTimeLimit) << asked << ": " << e.what();
    }
  }
  EXPECT_GT(partial, 3);
}

TEST(TimeLimit, ends_a_map_at_any_check_and_leaves_the_metric) {
  const mesh::Surface surface = test::grid(6, 5);
  const std::vector<double> target = flat_targets(surface);
  ConformalMapOptions options;
  options.metric.max_seconds = kLimit;
  int metric_only = 0;
  with_every_limit(120, [&](ExecutionContext& context) {
    const ConformalMapResult result = conformal_map(surface, nullptr, target, options, context);
    EXPECT_TRUE(result.metric.converged);
    if (!result.failure) {
      EXPECT_TRUE(result.map.certificate.ok);
      return;
    }
    EXPECT_EQ(result.failure->code, ErrorCode::kTimeLimit);
    ++metric_only;
    throw NotConverged(*result.failure);
  });
  EXPECT_GT(metric_only, 3);
}

TEST(TimeLimit, ends_a_round_boundary_at_any_check) {
  const mesh::Surface surface = test::grid(6, 5);
  BoundaryAnglesOptions options;
  options.shape = BoundaryGoal::kCircle;
  options.max_seconds = kLimit;
  with_every_limit(60, [&](ExecutionContext& context) {
    for (const double angle : boundary_angles(surface, options, context)) EXPECT_GT(angle, 0.0);
  });
}

TEST(TimeLimit, of_suggested_cones_returns_the_best_that_was_measured) {
  const mesh::Surface surface = test::sphere(12, 9);
  SuggestConesOptions options;
  options.max_seconds = kLimit;
  options.bound = 1.5;
  for (const double quantum : {0.0, std::numbers::pi / 2}) {
    options.quantum = quantum;
    with_every_limit(60, [&](ExecutionContext& context) {
      const SuggestedCones cones = suggest_cones(surface, options, context);
      EXPECT_EQ(cones.bound_holds, cones.scale_ratio <= options.bound * (1 + 1e-6));
      for (const double angle : cones.target_angles) EXPECT_GT(angle, 0.0);
    });
  }
}

TEST(TimeLimit, of_the_caller_goes_through_a_call_without_one) {
  const mesh::Surface surface = test::grid(6, 5);
  const std::vector<double> target = flat_targets(surface);
  for (const long asked : {5L, 20L, 60L}) {
    Clock clock;
    clock.asked = asked;
    ExecutionContext context;
    clock.install(context);
    const TimeLimit limit(context, kLimit);
    EXPECT_THROW(conformal_map(surface, nullptr, target, {}, context), TimeIsOver);
  }
}

}  // namespace
}  // namespace flipfree::conformal::time_limit_test
