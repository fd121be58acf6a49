#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <thread>

#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/islands/sheet.h"
#include "flipfree/unwrap/unwrap.h"
#include "support/shapes.h"

namespace flipfree::unwrap::unwrap_test {
namespace {

TEST(Unwrap, the_progress_bar_is_full_only_at_the_end) {
  const mesh::Surface surface = test::sphere(40, 30);
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
  const certify::Parametrization map = unwrap(surface, {}, context);
  ended = true;
  watcher.join();
  EXPECT_FALSE(too_early);
  EXPECT_EQ(context.fraction(), 1.0);
  EXPECT_TRUE(map.certificate.ok);
}

certify::Parametrization accepted_at_once(const mesh::Surface& surface,
                                          const UnwrapOptions& options = {}) {
  ExecutionContext context;
  context.accept();
  return unwrap(surface, options, context);
}

TEST(Unwrap, seams_are_accepted_once_they_will_do) {
  UnwrapOptions options;
  options.seams.find = true;
  const certify::Parametrization map = accepted_at_once(test::sphere(48, 24), options);
  EXPECT_EQ(std::get<std::int64_t>(map.stats.at("time_limit_reached")), 1);
  EXPECT_LT(map.certificate.energy, 1.3);  // after the first slit it is 1.44
}

// The embedding of a long tube on a circle shrinks far below what 32 bits hold.
TEST(Unwrap, accepted_maps_that_cannot_be_stored_yet_are_optimised_first) {
  const certify::Parametrization map = accepted_at_once(test::tube(12, 400));
  EXPECT_TRUE(map.certificate.ok);
}

TEST(Unwrap, accepted_maps_meet_their_pins) {
  const mesh::Surface surface = test::bumpy_grid(12, 12, 0.5, 3);
  ExecutionContext context;
  const certify::Parametrization free = unwrap(surface, {}, context);
  UnwrapOptions options;
  for (const CornerId c : {CornerId{0}, static_cast<CornerId>(surface.faces.size() - 1)})
    options.pins.push_back({c, free.uv32.row(c).cast<double>().transpose() * 2.0});
  const certify::Parametrization map = accepted_at_once(surface, options);
  EXPECT_TRUE(map.certificate.ok);
  for (const certify::CornerPin& pin : options.pins)
    EXPECT_EQ(map.uv32.row(pin.corner).cast<double>().transpose(), pin.uv);
}

TEST(ScaleField, is_zero_on_flat_surfaces_and_at_open_vertices) {
  const mesh::Surface sheet = test::grid(6, 6);
  std::vector<char> open(49, 0);
  for (VertexId v = 0; v < 49; ++v)
    open[static_cast<std::size_t>(v)] = v % 7 % 6 == 0 || v / 7 % 6 == 0 ? 1 : 0;
  ExecutionContext context;
  for (const double u : scale_field(sheet, open, context)) EXPECT_NEAR(u, 0.0, 1e-12);
}

// On a sphere of radius 1 that is open at one pole only up to a small circle of radius r around it:
// u = log((1 + cos a) / (1 + cos r)) in the angle a from the other pole, so log(2 / (1 - cos r)).
TEST(ScaleField, grows_towards_the_far_pole_of_a_ball_as_its_stereographic_map_does) {
  constexpr Index kSectors = 64;
  constexpr Index kRings = 64;
  const mesh::Surface ball = test::sphere(kSectors, kRings);
  std::vector<char> open(static_cast<std::size_t>(ball.vertices.rows()), 0);
  const double least = std::cos(8.5 * std::numbers::pi / kRings);
  VertexId far = 0;
  for (VertexId v = 0; v < ball.vertices.rows(); ++v) {
    open[static_cast<std::size_t>(v)] = ball.vertices(v, 2) > least ? 1 : 0;
    if (ball.vertices(v, 2) < ball.vertices(far, 2)) far = v;
  }
  ExecutionContext context;
  const std::vector<double> u = scale_field(ball, open, context);
  const double radius = 8.0 * std::numbers::pi / kRings;
  EXPECT_NEAR(u[static_cast<std::size_t>(far)], std::log(2.0 / (1.0 - std::cos(radius))), 0.1);
}

}  // namespace
}  // namespace flipfree::unwrap::unwrap_test
