#include "flipfree/conformal/engine/engine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "conformal/engine_inputs.h"

namespace flipfree::conformal::engine_double_test {
namespace {

TEST(DoubleEngine, IsTheEngineOfUpTo53Bits) {
  const mesh::Surface surface = test::torus(12, 8);
  const EngineInput input = test::flat_but_one(surface, 0);
  ExecutionContext context;
  for (const int bits : {1, 24, 53}) EXPECT_EQ(make_engine(input, bits, context)->bits(), 53);
  EXPECT_GT(make_engine(input, 54, context)->bits(), 53);
}

TEST(DoubleEngine, StartsAtTheSurfacesOwnAngles) {
  const mesh::Surface surface = test::sphere(9, 7);
  const EngineInput input = test::flat_but_one(surface, 3);
  ExecutionContext context;
  const auto engine = make_double_engine(input, context);
  ASSERT_TRUE(engine->started());
  Gradient gradient;
  engine->evaluate(1e-13, gradient, context);
  double sum = 0.0;
  for (const double x : gradient.value) sum += x;
  EXPECT_NEAR(sum, 0.0, 1e-10) << "Gauss-Bonnet holds of angles and of targets";
  EXPECT_EQ(engine->flips().size(), engine->euclidean_flips());
  engine->remember();
  for (const double x : engine->moved()) EXPECT_EQ(x, 0.0);
}

TEST(DoubleEngine, ScalingMultipliesLengthsByTheFactorsOfTheirEnds) {
  const mesh::Surface surface = test::torus(12, 8);
  const EngineInput input = test::flat_but_one(surface, 0);
  ExecutionContext context;
  const auto engine = make_double_engine(input, context);
  const std::vector<double> before = engine->lengths();
  FineVector x{std::vector<double>(input.target.size()), {}};
  for (std::size_t v = 0; v < x.high.size(); ++v)
    x.high[v] = 1e-3 * std::cos(static_cast<double>(v));
  engine->scale(x, context);
  const std::vector<double> after = engine->lengths();
  const intrinsic::IntrinsicMesh& mesh = engine->mesh();
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    const double sum = x.high[static_cast<std::size_t>(mesh.origin[2 * e])] +
                       x.high[static_cast<std::size_t>(mesh.origin[2 * e + 1])];
    EXPECT_NEAR(after[e], before[e] * std::exp(sum), 1e-15 * before[e]);
  }
}

}  // namespace
}  // namespace flipfree::conformal::engine_double_test
