#include "flipfree/conformal/engine/engine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "conformal/engine_inputs.h"

namespace flipfree::conformal::engine_mpfr_test {
namespace {

TEST(MpfrEngine, HasTheBitsThatAreAskedForUpToTheMost) {
  const mesh::Surface surface = test::torus(6, 5);
  const EngineInput input = test::flat_but_one(surface, 0);
  ExecutionContext context;
  for (const int bits : {64, 256, 257, 1024, 1025, 4096})
    EXPECT_EQ(make_engine(input, bits, context)->bits(), bits);
  EXPECT_EQ(make_mpfr_engine(input, 9999, context)->bits(), 4096);
}

TEST(MpfrEngine, AgreesWithDoubleWhereDoubleIsGoodEnough) {
  const mesh::Surface surface = test::torus(12, 8);
  const EngineInput input = test::flat_but_one(surface, 0);
  ExecutionContext context;
  const auto plain = make_double_engine(input, context);
  Gradient expected;
  FineVector x{std::vector<double>(input.target.size()), {}};
  for (std::size_t v = 0; v < x.high.size(); ++v)
    x.high[v] = std::sin(1.3 * static_cast<double>(v));
  plain->scale(x, context);
  ASSERT_TRUE(plain->restore_delaunay(context));
  plain->evaluate(1e-13, expected, context);
  for (const int bits : {100, 300, 2000}) {
    const auto fine = make_mpfr_engine(input, bits, context);
    fine->scale(x, context);
    ASSERT_TRUE(fine->restore_delaunay(context));
    Gradient gradient;
    fine->evaluate(1e-20, gradient, context);
    ASSERT_EQ(gradient.value.size(), expected.value.size());
    for (std::size_t v = 0; v < gradient.value.size(); ++v)
      EXPECT_NEAR(gradient.value[v], expected.value[v], 1e-11) << bits;
    EXPECT_NEAR(fine->energy(context).value, plain->energy(context).value, 1e-9);
  }
}

// Factors of exp(400) lie beyond the squares of doubles, not beyond MPFR's exponents.
TEST(MpfrEngine, FollowsWhereLengthsLeaveTheRangeOfDoubles) {
  const mesh::Surface surface = test::torus(12, 8);
  const EngineInput input = test::flat_but_one(surface, 0);
  ExecutionContext context;
  const auto engine = make_mpfr_engine(input, 128, context);
  FineVector x{std::vector<double>(input.target.size(), 0.0), {}};
  x.high[5] = 400.0;
  engine->scale(x, context);
  ASSERT_TRUE(engine->restore_delaunay(context));
  Gradient gradient;
  engine->evaluate(1e-13, gradient, context);
  EXPECT_TRUE(std::isfinite(gradient.max_error));
  EXPECT_NEAR(engine->scaled_so_far(context)[5].to_double(), 400.0, 1e-12);
}

}  // namespace
}  // namespace flipfree::conformal::engine_mpfr_test
