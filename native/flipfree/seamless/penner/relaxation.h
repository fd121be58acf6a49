// Brings a metric nearer to that of the input while its cones and loops stay as they are.
//
// The conformal metric of cones where the surface has no curvature spans many orders of magnitude:
// more than doubles hold as a map, and more than an optimisation of the map would like to start
// from. Lengths that are not conformal need not. The distance is that of the logarithms of edge
// lengths on the current triangulation, on which the input's metric is given by its Penner lengths
// (Capouellez, Zorin 2023, "Metric Optimization in Penner Coordinates"). It changes with the
// triangulation, so nothing is minimised strictly: a few steps do nearly all.
#pragma once

#include <memory>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/numeric/cholesky/cholesky.h"
#include "flipfree/seamless/penner/penner_newton.h"

namespace flipfree::seamless {

// The shortest change of the logarithms of edge lengths that meets the linearised equations for
// cone and loop angles (Capouellez, Zorin 2024): d = w + J' m with J d = g, nearest to a wish w.
//
// Unlike penner_system.h it counts conformal changes as well: it is what keeps a metric near
// another one, and what has to be factorized is J J', with twelve neighbours a vertex.

class ShortestSystem {
 public:
  // `wish`, `direction`: per edge. False if J J' is not positive definite to working precision.
  // Cost: an analysis and a factorization of the vertices' part, O(genus) solutions; loops enter by
  // their Schur complement.
  bool solve(const intrinsic::IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
             const PennerAngles& angles, const std::vector<double>& wish,
             std::vector<double>& direction, ExecutionContext& context);

 private:
  numeric::SparseCholesky cholesky_;
};

// The input's metric in Penner coordinates of a triangulation that is flipped.
class ReferenceMetric {
 public:
  // On the final triangulation of `metric`. Cost: O(flips).
  explicit ReferenceMetric(const intrinsic::FlippedMetric& metric);
  void flip(EdgeId e);
  // Logarithms of lengths over these, mean 0.
  std::vector<double> ratios(const std::vector<double>& lengths) const;

 private:
  intrinsic::FlipMesh mesh_;
  std::vector<double> logarithm_;
};

// A step changes no logarithm of a length by more than this.
inline constexpr double kMostRelaxationChange = 3.0;

class Relaxation {
 public:
  // `tolerance`: of all angles after a step. `engine` stands on the triangulation of `loops` and
  // `reference`.
  Relaxation(const PennerTargets& targets, double tolerance, ExecutionContext& context)
      : targets_(targets), tolerance_(tolerance), context_(context) {}

  // Takes one step and meets all angles again (penner_newton.h). False, and nothing done, if none
  // leads nearer. Precondition: all angles are met.
  bool step(std::unique_ptr<conformal::MetricEngine>& engine, intrinsic::LoopCarrier& loops,
            ReferenceMetric& reference);

 private:
  const PennerTargets& targets_;
  double tolerance_;
  ExecutionContext& context_;
  ShortestSystem system_;
};

// Means, around every vertex of the user's surface, of what the edges there have: the scale factors
// that explain the ratios best, more or less.
std::vector<double> vertex_means(const intrinsic::IntrinsicMesh& mesh,
                                 const std::vector<double>& ratios);

// Symmetric Dirichlet energy, at the best global scale, of a map that scales the surroundings of
// every vertex by exp(scale) alone; area: of the vertices.
double scaling_energy(const std::vector<double>& scale, const std::vector<double>& area);

// Newton's method for cone and loop angles by the shortest steps, from the input's own metric
// (Capouellez, Zorin 2024, Algorithm 1, in the coordinates of the current triangulation).
//
// The way from the conformal metric (penner_newton.h) is shorter, refines less and keeps to the
// shape. But where cones are far from a handle, that handle is exponentially large in the conformal
// metric, its loops turn by next to nothing, and making it larger still brings them nearer to
// nothing for free, with no end. Here every change of a length costs.

// As run_penner(). Loses its quadratic end to rounding earlier: run_penner() may follow.
PennerRun run_shortest(std::unique_ptr<conformal::MetricEngine>& engine,
                       intrinsic::LoopCarrier& loops, const PennerTargets& targets,
                       const PennerNewtonOptions& options, ExecutionContext& context);

}  // namespace flipfree::seamless
