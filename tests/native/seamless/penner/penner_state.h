// A closed surface with cones as Newton's method sees it: engine, loops, targets.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "support/shapes.h"

namespace flipfree::test {

// `count` cones of 3 and 5 quarter turns at random vertices of a surface of this genus; the sum
// decides how many of each.
inline std::vector<Index> random_cones(const mesh::Surface& surface, Index genus, Index count,
                                       unsigned seed) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  std::vector<std::size_t> places(cones.size());
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = i;
  std::mt19937 random(seed);
  std::shuffle(places.begin(), places.end(), random);
  const Index sharp = (count + 8 - 8 * genus) / 2;
  for (Index i = 0; i < count; ++i) cones[places[static_cast<std::size_t>(i)]] = i < sharp ? 3 : 5;
  return cones;
}

// A plate with two holes, bent at random so that no flip is near.
struct PennerState {
  PennerState(const PennerState&) = delete;
  PennerState& operator=(const PennerState&) = delete;
  explicit PennerState(unsigned seed = 4, Index fineness = 3) {
    constexpr Index kHoles = 2;
    surface = perforated_plate(kHoles, fineness);
    cones = random_cones(surface, kHoles, 16, seed);
    input.vertex_count = static_cast<Index>(surface.vertices.rows());
    input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-0.02, 0.02);
    for (double& x : surface.vertices.reshaped()) x += uniform(random);
    input.positions = &surface.vertices;
    for (const Index k : cones) input.target.push_back(k * 0.5 * std::numbers::pi);
    targets.vertex_angle = input.target;
    engine = conformal::make_engine(input, 53, context);
    const intrinsic::FlipMesh& mesh = engine->mesh();
    loops = std::make_unique<intrinsic::LoopCarrier>(
        mesh, intrinsic::homology_basis(mesh, std::vector<double>(engine->mesh().edge_count(), 1.0),
                                        context));
    targets.loop_angle.assign(loops->size(), 0.0);
  }

  seamless::PennerAngles measured() {
    seamless::PennerAngles angles;
    seamless::measure(*engine, *loops, targets, angles, context);
    return angles;
  }
  // Targets of the loops at the multiples of quarter turns that they are nearest to.
  void round_loops() {
    seamless::PennerAngles angles = measured();
    for (std::size_t i = 0; i < loops->size(); ++i) {
      const double now = targets.loop_angle[i] - angles.loops[i];
      targets.loop_angle[i] = 0.5 * std::numbers::pi * std::round(now / (0.5 * std::numbers::pi));
    }
  }

  ExecutionContext context;
  mesh::Surface surface;
  conformal::EngineInput input;  // which the engine refers to
  std::vector<Index> cones;
  seamless::PennerTargets targets;
  std::unique_ptr<conformal::MetricEngine> engine;
  std::unique_ptr<intrinsic::LoopCarrier> loops;
};

// All angles of the engine's metric, opposite each half-edge, by the law of cosines.
inline std::vector<long double> angles_of(const conformal::MetricEngine& engine) {
  const std::vector<double> length = engine.lengths();
  const auto of = [&](HalfedgeId h) -> long double {
    return length[static_cast<std::size_t>(h >> 1)];
  };
  const intrinsic::IntrinsicMesh& mesh = engine.mesh();
  std::vector<long double> angle(mesh.halfedge_count());
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(angle.size()); ++h) {
    const long double a = of(h), b = of(mesh.next_of(h)), c = of(mesh.previous(h));
    angle[static_cast<std::size_t>(h)] = std::acos((b * b + c * c - a * a) / (2 * b * c));
  }
  return angle;
}

// Largest difference between the metric's angles, by sums of their own, and the targets.
inline double largest_error(const PennerState& state) {
  const auto angle = angles_of(*state.engine);
  const intrinsic::IntrinsicMesh& mesh = state.engine->mesh();
  std::vector<long double> left(state.targets.vertex_angle.begin(),
                                state.targets.vertex_angle.end());
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(angle.size()); ++h)
    left[static_cast<std::size_t>(
        mesh.unknown[static_cast<std::size_t>(mesh.origin_of(mesh.previous(h)))])] -=
        angle[static_cast<std::size_t>(h)];
  for (std::size_t i = 0; i < state.loops->size(); ++i) {
    left.push_back(state.targets.loop_angle[i]);
    state.loops->visit_corners(i, [&](const intrinsic::PassedCorner& c) {
      left.back() -= c.sign * angle[static_cast<std::size_t>(c.opposite)];
    });
  }
  long double largest = 0;
  for (const long double x : left) largest = std::max(largest, std::abs(x));
  return static_cast<double>(largest);
}

}  // namespace flipfree::test
