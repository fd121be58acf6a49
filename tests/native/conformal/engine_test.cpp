#include "flipfree/conformal/engine/engine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/shapes.h"

namespace flipfree::conformal::engine_test {
namespace {

// Angles of all vertices 2 pi but for one cone, which takes what is left: of a closed surface,
// which must outlive the result.
EngineInput flat_but_one(const mesh::Surface& surface, VertexId cone) {
  EngineInput input = input_of(surface);
  const double pi = std::numbers::pi;
  input.target.assign(static_cast<std::size_t>(input.vertex_count), 2.0 * pi);
  double sum = 0.0;
  for (const double t : input.target) sum += t;
  input.target[static_cast<std::size_t>(cone)] +=
      pi * static_cast<double>(surface.faces.rows()) - sum;
  return input;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// The gradient integrated along a straight line of u (Simpson) is the difference of energies, over
// many flips.
void expect_energy_fits_gradient(const mesh::Surface& surface, int bits, bool flat) {
  ExecutionContext context;
  EngineInput input = flat_but_one(surface, 0);
  if (!flat) {  // any targets do: the identity needs no Gauss-Bonnet
    for (std::size_t v = 0; v < input.target.size(); ++v)
      input.target[v] = 3.0 + 0.01 * static_cast<double>(v % 7);
  }
  const auto engine = make_engine(input, bits, context);
  const std::size_t n = input.target.size();
  constexpr int kSteps = 400;  // even
  FineVector half{std::vector<double>(n), {}};
  std::vector<double> direction(n);
  for (std::size_t v = 0; v < n; ++v) {
    direction[v] = 2.0 * std::sin(1.7 * static_cast<double>(v));
    half.high[v] = 0.5 * direction[v] / kSteps;
  }
  const double before = engine->energy(context).value;
  Gradient gradient;
  double integral = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    engine->evaluate(1e-13, gradient, context);
    const double weight = i == 0 || i == kSteps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    integral += weight / (3.0 * kSteps) * dot(direction, gradient.value);
    if (i == kSteps) break;
    engine->scale(half, context);
    ASSERT_TRUE(engine->restore_delaunay(context));
  }
  EXPECT_GT(engine->flips().size(), engine->euclidean_flips() + 20);
  EXPECT_NEAR(engine->energy(context).value - before, integral, 1e-4);
}

TEST(MetricEngine, EnergyIsTheIntegralOfTheGradientAcrossFlips) {
  expect_energy_fits_gradient(test::torus(12, 8), 53, true);
  expect_energy_fits_gradient(test::torus(12, 8), 128, true);
}

TEST(MetricEngine, EnergyIsTheIntegralOfTheGradientOnDoubleCovers) {
  expect_energy_fits_gradient(test::bumpy_grid(8, 6, 0.3, 2.0), 53, false);
}

// Found when single cones of many handles stalled: the search of one vertex ended after a fixed
// number of small steps, hundreds of radians beyond its target and with more energy than before.
TEST(MetricEngine, RelaxedVertexMeetsItsAngleAndTheEnergyFalls) {
  ExecutionContext context;
  const mesh::Surface surface = test::torus(24, 16);
  const EngineInput input = flat_but_one(surface, 0);
  const auto engine = make_engine(input, 200, context);
  // Clusters on several scales, so that single vertices see the others from far away.
  FineVector half{std::vector<double>(input.target.size()), {}};
  for (std::size_t v = 0; v < half.high.size(); ++v) {
    half.high[v] = 0.5 * (v % 5 == 0 ? -9.0 : v % 3 == 0 ? 6.0 : 0.1 * static_cast<double>(v % 11));
  }
  engine->scale(half, context);
  ASSERT_TRUE(engine->restore_delaunay(context));
  Gradient gradient;
  double energy = engine->energy(context).value;
  for (VertexId v = 0; v < input.vertex_count; v += 3) {
    const std::size_t at = static_cast<std::size_t>(v);
    const double half_before = engine->scaled_so_far(context)[at].to_double();
    ASSERT_TRUE(engine->relax(
        {v}, 1e-3, [] { return false; }, context));
    engine->evaluate(1e-13, gradient, context);
    const Energy after = engine->energy(context);
    EXPECT_LE(after.value, energy + 2.0 * after.noise) << v;
    energy = after.value;
    const double moved =
        2.0 * std::abs(engine->scaled_so_far(context)[at].to_double() - half_before);
    // A vertex that would have to move by more than the bound of one relaxation waits there.
    EXPECT_TRUE(std::abs(gradient.value[at]) <= 1.01e-3 || moved > 1.99)
        << v << ": " << gradient.value[at] << " left after moving by " << moved;
  }
}

// Flips are done in the order of their places on the vertex' way, known in closed form: the
// triangulation that is left is the Delaunay one, and no more flips were done than it takes. Going
// to a trial's end and flipping there cost tens of thousands where a vertex becomes a hub.
TEST(MetricEngine, RelaxationLeavesTheDelaunayTriangulationByFewFlips) {
  ExecutionContext context;
  const mesh::Surface surface = test::torus(40, 30);
  for (const int bits : {53, 128}) {
    const EngineInput input = flat_but_one(surface, 0);
    const auto engine = make_engine(input, bits, context);
    FineVector half{std::vector<double>(input.target.size(), 0.0), {}};
    half.high[0] = 6.0;    // far from where it belongs: every edge of its star is flipped away
    half.high[41] = -5.0;  // a hub
    engine->scale(half, context);
    ASSERT_TRUE(engine->restore_delaunay(context));
    Gradient gradient;
    engine->evaluate(1e-13, gradient, context);
    ASSERT_GT(std::abs(gradient.value[41]), 100.0);
    engine->remember();
    const std::size_t before = engine->flips().size();
    for (int i = 0; i < 10; ++i) {
      ASSERT_TRUE(engine->relax(
          {41}, 1e-3, [] { return false; }, context));
    }
    engine->evaluate(1e-13, gradient, context);
    EXPECT_LE(std::abs(gradient.value[41]), 1.01e-3);
    EXPECT_NEAR(engine->moved()[41], 2.0 * (engine->scaled_so_far(context)[41].to_double() + 5.0),
                1e-9);
    const std::size_t done = engine->flips().size() - before;
    EXPECT_GT(done, 20u);
    EXPECT_LT(done, 1500u);
    ASSERT_TRUE(engine->restore_delaunay(context));
    EXPECT_EQ(engine->flips().size(), before + done);
  }
}

// A needle above an edge and a nearly flat triangle below it: their cotangents are +-1e9, their sum
// is 1e-6, which doubles would give to one place.
TEST(MetricEngine, WeightsOfNearlyCocircularNeedlesKeepTheirPlaces) {
  ExecutionContext context;
  const double up = std::ldexp(1.0, 30);
  const double excess = std::ldexp(1.0, -50);
  const double down = 0.25 / up * (1.0 + excess);
  mesh::Surface surface;  // a flat quadrilateral, both sides of it
  surface.vertices.resize(4, 3);
  surface.vertices << -0.5, 0, 0, 0.5, 0, 0, 0, up, 0, 0, -down, 0;
  surface.faces = Triangles{{0, 1, 2}, {1, 0, 3}, {0, 2, 3}, {1, 3, 2}};
  const EngineInput input = flat_but_one(surface, 0);
  const auto engine = make_engine(input, 200, context);
  Gradient gradient;
  engine->evaluate(1e-13, gradient, context);
  // cot = y - 1 / (4 y) at a distance y above the middle of an edge of length 1.
  const double expected = 0.5 * (up + down) * (excess / (1.0 + excess));
  const intrinsic::IntrinsicMesh& m = engine->mesh();
  int found = 0;
  for (std::size_t e = 0; e < m.edge_count(); ++e) {
    if (m.origin[2 * e] + m.origin[2 * e + 1] != 1) continue;  // vertices 0 and 1
    ++found;
    const double w = gradient.half_cotangent[2 * e] + gradient.half_cotangent[2 * e + 1];
    EXPECT_NEAR(w, expected, 1e-12 * expected);
  }
  EXPECT_GE(found, 1);
}

}  // namespace
}  // namespace flipfree::conformal::engine_test
