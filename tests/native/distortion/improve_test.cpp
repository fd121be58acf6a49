#include "flipfree/distortion/improve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "flipfree/certify/measures.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::distortion::improve_test {
namespace {

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
