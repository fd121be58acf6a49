#include "flipfree/conformal/cones/cone_placement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "conformal/engine_inputs.h"

namespace flipfree::conformal::cone_placement_test {
namespace {

// A closed surface with vertex 0 as the base.
struct Placement {
  explicit Placement(const mesh::Surface& surface) {
    EngineInput input = test::flat_but_one(surface, 0);
    input.target.assign(input.target.size(), 2 * std::numbers::pi);
    const auto engine = make_double_engine(input, context);
    engine->evaluate(1e-13, gradient, context);
    std::vector<char> base(gradient.value.size(), 0);
    base[0] = 1;
    linear.emplace(engine->mesh(), gradient, base, context);
  }
  ExecutionContext context;
  Gradient gradient;
  std::optional<LinearPlacement> linear;
};

TEST(LinearPlacement, ConesTakeTheCurvatureWhereTheyAre) {
  const mesh::Surface surface = test::sphere(14, 11);
  Placement p(surface);
  LinearPlacement& linear = *p.linear;
  EXPECT_NEAR(linear.total_curvature, 4 * std::numbers::pi, 1e-10);
  EXPECT_NEAR(linear.base_charge(), linear.total_curvature, 1e-12) << "no cone yet";
  for (const VertexId v : {40, 90, 120}) {
    linear.add(v, p.context);
    for (const VertexId w : linear.cones)
      EXPECT_NEAR(linear.u[static_cast<std::size_t>(w)], 0.0, 1e-10);
    EXPECT_EQ(linear.u[0], 0.0);
    EXPECT_NEAR(linear.base_charge() + linear.charge.sum(), linear.total_curvature, 1e-12);
  }
  EXPECT_EQ(linear.cones, (std::vector<VertexId>{40, 90, 120}));
  EXPECT_GT(linear.charge.minCoeff(), 0.0) << "far apart on a sphere all take a part of it";
}

// Symmetric, zero at the base, and largest where the charge is.
TEST(LinearPlacement, ResponsesAreGreensFunctions) {
  const mesh::Surface surface = test::torus(14, 10);
  Placement p(surface);
  const std::vector<double> a = p.linear->response(30, p.context);
  const std::vector<double> b = p.linear->response(77, p.context);
  EXPECT_NEAR(a[77], b[30], 1e-12);
  EXPECT_EQ(a[0], 0.0);
  EXPECT_EQ(std::max_element(a.begin(), a.end()) - a.begin(), 30);
}

TEST(LinearPlacement, TheExtremeIsNeitherConeNorBase) {
  const mesh::Surface surface = test::sphere(14, 11);
  Placement p(surface);
  LinearPlacement& linear = *p.linear;
  double before = linear.range();
  for (int i = 0; i < 6; ++i) {
    const VertexId v = linear.extreme();
    ASSERT_NE(v, kInvalid);
    EXPECT_NE(v, 0);
    EXPECT_EQ(std::find(linear.cones.begin(), linear.cones.end(), v), linear.cones.end());
    linear.add(v, p.context);
  }
  EXPECT_LT(linear.range(), 0.5 * before);
}

TEST(LinearPlacement, WithoutPotentialThereIsNoExtreme) {
  const mesh::Surface surface = test::torus(14, 10);
  Placement p(surface);
  LinearPlacement& linear = *p.linear;
  linear.u.assign(linear.u.size(), 0.0);
  EXPECT_EQ(linear.extreme(), kInvalid);
  EXPECT_EQ(linear.range(), 0.0);
}

}  // namespace
}  // namespace flipfree::conformal::cone_placement_test
