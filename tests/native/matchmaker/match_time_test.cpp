// Limits of time, with a clock that goes a little at every look at it: a limit can end the work
// at any place where it may end, and always at the same one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/match.h"
#include "matchmaker/requests.h"

namespace flipfree::matchmaker::match_time_test {
namespace {

constexpr double kTick = 1e-4;  // seconds per look, about as often as the work looks at it
constexpr double kLong = 1e15;  // looks

struct Outcome {
  bool found = false;
  bool limited = false;  // the map says that time was short
  double looks = 0;      // at the clock
  Index vertices = 0;
  std::int64_t given_up = 0;  // ways that ran out of their share
};

Outcome match_for(const mesh::Surface& surface, const MatchRequest& request, MatchOptions options,
                  double looks) {
  ExecutionContext context;
  context.threads = 1;
  Outcome outcome;
  context.clock = [&] { return kTick * (outcome.looks += 1); };
  options.max_seconds = kTick * looks;
  try {
    const certify::Parametrization map = match_piece(surface, request, options, context);
    outcome.found = true;
    outcome.limited = std::get<std::int64_t>(map.stats.at("time_limit_reached")) != 0;
    if (map.stats.contains("ways_out_of_time"))
      outcome.given_up = std::get<std::int64_t>(map.stats.at("ways_out_of_time"));
    outcome.vertices = static_cast<Index>(map.surface.vertices.rows());
    test::expect_met(map, request);
  } catch (const NotConverged& error) {
    EXPECT_EQ(error.error().code, ErrorCode::kTimeLimit) << error.what();
    EXPECT_NE(std::string(error.what()).find("Allow more time"), std::string::npos);
  }
  return outcome;
}

// The first map that meets the pins is returned, certified.
TEST(MatchTime, AcceptedBeforeThereIsAMapReturnsTheFirstOne) {
  const mesh::Surface surface = test::bumpy_grid(14, 14, 0.5, 3);
  MatchRequest request;
  request.points = {{40, {0.3, 0.3}}, {100, {0.7, 0.5}}, {150, {0.4, 0.8}}};
  for (const bool bijective : {true, false}) {
    MatchOptions options;
    options.bijective = bijective;
    ExecutionContext context;
    context.accept();
    const certify::Parametrization map = match_piece(surface, request, options, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(std::get<std::int64_t>(map.stats.at("time_limit_reached")), 1);
  }
}

// Limits all over the time that the work takes: each gives a valid map with all pins, or says that
// there was no time; with less time more vertices are left.
TEST(MatchTime, EndsAnywhereWithAMapOrTheTimeLimit) {
  const mesh::Surface surface = test::bumpy_grid(8, 8, 0.2, 3);
  const auto n = static_cast<VertexId>(surface.vertices.rows());
  MatchRequest request;  // two that change places, and one between them
  request.points = {{n / 2 + 3, {0.25, 0.45}}, {n / 2 - 3, {0.75, 0.55}}, {n / 4, {0.5, 0.5}}};
  for (const MatchEngine engine : {MatchEngine::kAuto, MatchEngine::kMatchmaker}) {
    MatchOptions options;
    options.engine = engine;
    const Outcome whole = match_for(surface, request, options, kLong);
    EXPECT_TRUE(whole.found);
    EXPECT_FALSE(whole.limited);
    int stopped = 0;
    for (int i = 0; i < 12; ++i) {
      const double looks = std::max(1.0, 1.2 * whole.looks * i / 12);
      const Outcome outcome = match_for(surface, request, options, looks);
      EXPECT_TRUE(i > 0 || !outcome.found);
      if (!outcome.found || !outcome.limited) continue;
      if (engine == MatchEngine::kMatchmaker && ++stopped == 1) {
        EXPECT_GT(outcome.vertices, whole.vertices);
      }
    }
    EXPECT_TRUE(engine == MatchEngine::kAuto || stopped > 0);
  }
}

TEST(MatchTime, AWayThatRunsOutOfItsShareLeavesTimeForTheNext) {
  const mesh::Surface surface = test::bumpy_grid(9, 9, 0.2, 3);
  MatchRequest request;
  for (VertexId i = 0; i < 8; ++i)
    request.points.push_back({20 + 11 * i, {0.5 + 0.03 * ((7 * i) % 12), 0.04 * ((5 * i) % 12)}});
  const double whole = match_for(surface, request, {}, kLong).looks;
  bool rescued = false;
  for (int i = 1; i <= 8 && !rescued; ++i) {
    const Outcome outcome = match_for(surface, request, {}, whole * i / 8);
    rescued = outcome.found && outcome.given_up > 0;
  }
  EXPECT_TRUE(rescued);
}

}  // namespace
}  // namespace flipfree::matchmaker::match_time_test
