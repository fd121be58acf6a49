#include "flipfree/distortion/improve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/certify/measures.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::distortion::improve_test {
namespace {

double number(const Stats& stats, const char* key) { return std::get<double>(stats.at(key)); }

TEST(Improve, lowers_the_energy_and_keeps_centre_scale_and_cuts) {
  const mesh::Surface surface = test::bumpy_grid(12, 12, 0.5, 2.0);
  Points2 uv = test::flat(surface);
  // Two charts: the faces right of the middle are moved away.
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (uv.middleRows<3>(3 * f).col(0).mean() > 0.5) uv.middleRows<3>(3 * f).col(0).array() += 3.0;
  }
  ExecutionContext context;
  const certify::Parametrization map = improve(surface, uv, {}, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(std::get<std::int64_t>(map.stats.at("charts")), 2);
  EXPECT_LT(number(map.stats, "energy"), number(map.stats, "energy_before"));
  EXPECT_EQ(map.certificate.overlaps, 0);
  EXPECT_EQ(map.surface.faces, surface.faces);
  EXPECT_EQ(map.cut_edges.rows(), 12);
}

TEST(Improve, pins_are_met_bit_for_bit) {
  const mesh::Surface surface = test::bumpy_grid(8, 8, 0.4, 2.0);
  ImproveOptions options;
  options.pins = {{0, Vector2(0.25, 0.125)}, {3 * 127 + 1, Vector2(0.75, 1.0)}};
  ExecutionContext context;
  const certify::Parametrization map = improve(surface, test::flat(surface), options, context);
  EXPECT_EQ(map.certificate.pin_failures, 0);
  for (const certify::CornerPin& pin : options.pins)
    EXPECT_EQ(Vector2(map.uv.row(pin.corner)), pin.uv);
}

TEST(Improve, corners_of_one_place_with_two_pins_are_refused) {
  const mesh::Surface surface = test::grid(3, 3);
  ImproveOptions options;
  // Two corners at vertex 0.
  std::vector<CornerId> at_zero;
  for (CornerId c = 0; c < 54; ++c) {
    if (surface.faces(c / 3, c % 3) == 0) at_zero.push_back(c);
  }
  ASSERT_EQ(at_zero.size(), 2U);
  options.pins = {{at_zero[0], Vector2(0, 0)}, {at_zero[1], Vector2(0, 0.5)}};
  ExecutionContext context;
  try {
    improve(surface, test::flat(surface), options, context);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kBadPins);
  }
}

// Nothing is left to gain in these maps, and rounding folds them: unfolded values have to be
// returned though they cost energy, not the input's own with their folds.
TEST(Improve, perfect_maps_that_rounding_folds_are_certified) {
  int folded = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    mesh::Surface surface = test::bumpy_grid(10, 10, 0.2, 2.0);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> noise(-0.015, 0.015);
    for (double& x : surface.vertices.leftCols<2>().reshaped()) x += noise(random);
    ImproveOptions options;
    options.tolerance = 1e-13;
    ExecutionContext context;
    Points2 uv = improve(surface, test::flat(surface), options, context).uv;
    // Cells of about one step of the floats around 1000.
    uv = (11 * std::ldexp(1.0, -14) * uv).eval();
    uv.array() += 1000.0;
    folded += !certify::flipped_faces(Points2f(uv.cast<float>())).empty();
    const certify::Parametrization map = improve(surface, uv, options, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(map.certificate.flips32, 0);
  }
  EXPECT_GT(folded, 5);
}

}  // namespace
}  // namespace flipfree::distortion::improve_test
