// The metric with prescribed cones and loop angles, measured by sums of its own: long double, the
// law of cosines, a homology basis that the solver has not seen.
#include "flipfree/seamless/penner/penner_metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/intrinsic/loops.h"
#include "seamless/cones.h"
#include "support/loops.h"
#include "support/shapes.h"

namespace flipfree::seamless::penner_metric_test {
namespace {

constexpr long double kQuarterTurn = std::numbers::pi_v<long double> / 2;

std::vector<Index> flat(const mesh::Surface& surface) {
  return std::vector<Index>(static_cast<std::size_t>(surface.vertices.rows()), 4);
}

// The angle opposite each half-edge.
std::vector<long double> angles(const conformal::ConformalMetric& metric) {
  const auto& length = std::get<std::vector<double>>(metric.length);
  const auto of = [&](HalfedgeId h) { return static_cast<long double>(length[at(h >> 1)]); };
  std::vector<long double> angle(metric.mesh.halfedge_count());
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(angle.size()); ++h) {
    const long double a = of(h), b = of(metric.mesh.next[at(h)]), c = of(metric.mesh.previous(h));
    angle[at(h)] = std::acos((b * b + c * c - a * a) / (2 * b * c));
  }
  return angle;
}

// The loops of a basis with random steps, after all flips, and the half-edge numbers of the input.
intrinsic::LoopCarrier other_basis(const conformal::ConformalMetric& metric, unsigned seed) {
  const intrinsic::FlipMesh& mesh = metric.initial;
  intrinsic::LoopCarrier carrier(mesh, test::random_basis(mesh, seed));
  for (const auto& flip : metric.flips) {
    for (int k = 0; k < flip.plain.count; ++k)
      carrier.flip(flip.plain.edges[static_cast<std::size_t>(k)]);
  }
  return carrier;
}

void expect_seamless(const PennerMetric& result, const std::vector<Index>& cones) {
  const auto& metric = result.metric;
  const auto angle = angles(metric);
  std::vector<long double> sum(cones.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(angle.size()); ++h)
    sum[at(metric.mesh.origin[at(metric.mesh.previous(h))])] += angle[at(h)];
  for (std::size_t v = 0; v < cones.size(); ++v)
    EXPECT_NEAR(static_cast<double>(sum[v] - cones[v] * kQuarterTurn), 0.0, 1e-10) << v;
  const intrinsic::LoopCarrier loops = other_basis(metric, 11);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    long double turn = 0;
    loops.visit_corners(
        i, [&](const intrinsic::PassedCorner& c) { turn += c.sign * angle[at(c.opposite)]; });
    EXPECT_NEAR(static_cast<double>(std::remainder(turn, kQuarterTurn)), 0.0, 1e-9) << i;
  }
}

PennerMetric solve(const mesh::Surface& surface, const std::vector<Index>& cones,
                   const std::optional<std::vector<LoopTurn>>& loops = {}, int threads = 2) {
  ExecutionContext context;
  context.threads = threads;
  return compute_penner_metric(surface, cones, loops, {}, context);
}

TEST(PennerMetric, RandomConesOnGenusZeroToThree) {
  for (Index genus = 0; genus <= 3; ++genus) {
    const mesh::Surface surface =
        genus == 0 ? test::sphere(20, 14) : test::perforated_plate(genus, 4);
    for (unsigned seed = 0; seed < 4; ++seed) {
      const auto cones =
          test::random_cones(surface, genus, 20, 10 * static_cast<unsigned>(genus) + seed);
      const PennerMetric result = solve(surface, cones);
      EXPECT_EQ(result.loops.size(), at(2 * genus));
      EXPECT_LE(result.metric.angle_error, 1e-10);
      expect_seamless(result, cones);
    }
  }
}

TEST(PennerMetric, TorusWithoutConesTurnsNowhere) {
  const mesh::Surface surface = test::torus(24, 10, 0.4);
  const PennerMetric result = solve(surface, flat(surface));
  for (const LoopTurn& loop : result.loops) EXPECT_EQ(loop.quarter_turns, 0);
  expect_seamless(result, flat(surface));
  auto loops = result.loops;
  loops[0].quarter_turns = 1;
  EXPECT_THROW(solve(surface, flat(surface), loops), Infeasible);
}

TEST(PennerMetric, MeetsOtherTurnsThanTheNearest) {
  const mesh::Surface surface = test::perforated_plate(2, 4);
  const auto cones = test::random_cones(surface, 2, 20, 5);
  auto loops = solve(surface, cones).loops;
  for (std::size_t i = 0; i < loops.size(); ++i) loops[i].quarter_turns += i % 2 == 0 ? 1 : -1;
  const PennerMetric result = solve(surface, cones, loops);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    EXPECT_EQ(result.loops[i].quarter_turns, loops[i].quarter_turns);
    EXPECT_NEAR(result.loop_error[i], 0.0, 1e-10);
  }
  expect_seamless(result, cones);
}

TEST(PennerMetric, RefusesLoopsThatAreNoStrips) {
  const mesh::Surface surface = test::torus(12, 8, 0.4);
  std::vector<Index> cones = test::random_cones(surface, 1, 8, 2);
  auto loops = solve(surface, cones).loops;
  auto broken = loops;
  broken[0].loop.pop_back();
  EXPECT_THROW(solve(surface, cones, broken), InvalidInput);
  broken = loops;
  broken.pop_back();
  EXPECT_THROW(solve(surface, cones, broken), InvalidInput);
  broken = loops;
  broken[1].loop[0] = -3;
  EXPECT_THROW(solve(surface, cones, broken), InvalidInput);
}

// Boundary straight with corners, strips between its curves and loops around handles in quarters.
TEST(PennerMetric, AlignedBoundariesTurnInQuarters) {
  mesh::Surface surface = test::torus(16, 12);
  Triangles kept(surface.faces.rows() - 2, 3);
  kept << surface.faces.row(0), surface.faces.middleRows(2, 199), surface.faces.bottomRows(182);
  surface.faces = kept;
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  const auto setup =
      intrinsic::build_intrinsic_mesh(static_cast<Index>(cones.size()), surface.faces);
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (setup.on_boundary[v]) cones[v] = kNotGiven;
  }
  ExecutionContext context;
  cones = aligned_cones(surface, cones, context);
  const PennerMetric metric = solve(surface, cones);
  EXPECT_LE(metric.metric.angle_error, 1e-9);
  EXPECT_EQ(metric.loops.size(), 3U);
  for (std::size_t v = 0; v < cones.size(); ++v)
    EXPECT_NEAR(metric.metric.angles[v], cones[v] * 0.5 * std::numbers::pi, 1e-9);
}

// Its double would be a torus with the cones 2 and 6 whose loops all turn by even numbers.
TEST(PennerMetric, ATubeCannotHaveTwoCornersAtOneEnd) {
  const mesh::Surface cylinder = test::cylinder(8, 3);
  ExecutionContext context;
  auto cones = aligned_cones(
      cylinder,
      flat_inside(std::vector<Index>(static_cast<std::size_t>(cylinder.vertices.rows()), kNotGiven),
                  mesh::build_adjacency(cylinder)),
      context);
  cones[0] = 1;
  cones[3] = 3;
  EXPECT_THROW(solve(cylinder, cones), Infeasible);
}

}  // namespace
}  // namespace flipfree::seamless::penner_metric_test
