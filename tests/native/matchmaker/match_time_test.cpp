// Limits of time, with a clock that goes a little at every look at it: a limit can end the work
// at any place where it may end, and always at the same one.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/match.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::match_time_test {
namespace {

constexpr double kTick = 1e-4;  // seconds per look, about as often as the work looks at it
constexpr double kLong = 1e15;  // looks

struct Outcome {
  bool found = false;
  double looks = 0;           // at the clock
  std::int64_t given_up = 0;  // ways that ran out of their share
};

// Certified, and every pinned vertex bit for bit where it shall be, in 64 and in 32 bits.
void expect_met(const certify::Parametrization& map, const MatchRequest& request) {
  EXPECT_TRUE(map.certificate.ok);
  const auto expect_at = [&](VertexId v, const Vector2& uv) {
    for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
      if (map.surface.faces.data()[c] != v) continue;
      EXPECT_EQ(map.uv.row(c).transpose(), uv) << v;
      EXPECT_EQ(map.uv32.row(c).transpose(), uv.cast<float>()) << v;
    }
  };
  for (const PinnedVertex& p : request.points) expect_at(p.vertex, p.uv);
  for (std::size_t i = 0; i < request.boundary_loop.size(); ++i)
    expect_at(request.boundary_loop[i], request.boundary_uv[i]);
}

Outcome match_for(const mesh::Surface& surface, const MatchRequest& request, MatchOptions options,
                  double looks) {
  ExecutionContext context;
  context.threads = 1;
  Outcome outcome;
  context.clock = [&] { return kTick * (outcome.looks += 1); };
  options.max_seconds = kTick * looks;
  try {
    const certify::Parametrization map = match(surface, request, options, context);
    outcome.found = true;
    if (map.stats.contains("ways_out_of_time"))
      outcome.given_up = std::get<std::int64_t>(map.stats.at("ways_out_of_time"));
    expect_met(map, request);
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
    const certify::Parametrization map = match(surface, request, options, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(std::get<std::int64_t>(map.stats.at("time_limit_reached")), 1);
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
