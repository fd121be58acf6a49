// Newton's method for cone and loop angles on a metric that is kept Delaunay by Ptolemy flips.
//
// Ptolemy flips are exact changes of coordinates of the space of metrics, so every step is taken in
// the edge lengths of the triangulation that is Delaunay at the moment, and loops are carried
// along.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/newton_system.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/loops.h"

namespace flipfree::seamless {

// What is prescribed.
struct PennerTargets {
  std::vector<double> vertex_angle;  // #V of the user's surface
  std::vector<double> loop_angle;    // #loops
};

// A metric in an engine, and loops in its triangulation. Copied by its state.
struct LoopedMetric {
  // Goes on from `metric` with so many bits; `carried`: on its final triangulation.
  LoopedMetric(const conformal::ConformalMetric& metric, const PennerTargets& targets,
               intrinsic::LoopCarrier carried, int bits, ExecutionContext& context);
  LoopedMetric(const LoopedMetric& other)
      : input(other.input),
        engine(other.engine->copy()),
        loops(other.loops),
        followed(other.followed) {}
  LoopedMetric(LoopedMetric&&) = default;
  LoopedMetric& operator=(LoopedMetric&&) = default;

  const intrinsic::IntrinsicMesh& mesh() const { return engine->mesh(); }
  // Carries the loops through the engine's flips since it was done last.
  void follow(const ExecutionContext& context);
  // Appends what was reached to the metric from which this went on.
  void append_to(conformal::ConformalMetric& metric, const ExecutionContext& context) const;

  std::shared_ptr<const conformal::EngineInput> input;  // which engines read to their end
  std::unique_ptr<conformal::MetricEngine> engine;
  intrinsic::LoopCarrier loops;
  std::size_t followed = 0;  // flips
};

// The angles of a metric against what is prescribed.
struct PennerAngles {
  std::vector<double> cotangent;  // #H: of the angle opposite each half-edge
  conformal::Gradient vertices;   // value: target - angle; half cotangents
  std::vector<double> loops;      // target - angle
  double max_error = 0.0;         // of both; infinite if an angle is no number
  double norm = 0.0;              // of both
};
PennerAngles measure(const LoopedMetric& metric, const PennerTargets& targets,
                     ExecutionContext& context);

// What it costs to turn loops by e more, e' N e: the square of the length of the shortest stretch
// that does it. N, #loops x #loops; the identity where that is not known. Cost: a factorization,
// 2 g solutions, O(g^2 #E).
Eigen::MatrixXd norm_of_turns(const LoopedMetric& metric, const PennerAngles& angles,
                              ExecutionContext& context);

// Radians from which errors of angles fall quadratically, so that the rest costs little.
inline constexpr double kNearlyMet = 1e-4;

enum class PennerEnd {
  kConverged,
  kStalled,  // no step lowers the error by much
  kIterations,
};

struct PennerNewtonOptions {
  double tolerance = 1e-10;  // of every angle, radians
  int max_iterations = 100;
};

struct PennerRun {
  PennerEnd end = PennerEnd::kIterations;
  double error = std::numeric_limits<double>::infinity();
  int iterations = 0;
  int restored = 0;  // steps after which the cones were met again by conformal changes alone
  std::vector<double> error_history;
};

// Iterates from the present metric. The norm of all errors falls with every step. Throws Cancelled,
// TimeIsOver.
PennerRun run_penner(LoopedMetric& metric, const PennerTargets& targets,
                     const PennerNewtonOptions& options, ExecutionContext& context);

// Brings a metric nearer to that of the input while its cones and loops stay as they are.
//
// The conformal metric of cones where the surface has no curvature spans many orders of magnitude:
// more than doubles hold as a map, and more than an optimisation of the map would like to start
// from. Lengths that are not conformal need not. The distance is that of the logarithms of edge
// lengths on the current triangulation, on which the input's metric is given by its Penner lengths
// (Capouellez, Zorin 2023, "Metric Optimization in Penner Coordinates"). It changes with the
// triangulation, so nothing is minimised strictly: a few steps do nearly all.

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

// How angles are met: by conformal changes as far as cones go, or by the shortest steps, which stay
// near to a metric that is not conformal.
enum class Meeting { kConformal, kShortest };

// Means, around every vertex of the user's surface, of what the edges there have: the scale factors
// that explain the ratios best, more or less.
std::vector<double> vertex_means(const intrinsic::IntrinsicMesh& mesh,
                                 const std::vector<double>& ratios);

// Symmetric Dirichlet energy, at the best global scale, of a map that scales the surroundings of
// every vertex by exp(scale) alone; area: of the vertices.
double scaling_energy(const std::vector<double>& scale, const std::vector<double>& area);

struct Nearing {
  double tolerance = 0.0;  // of all angles after a step
  int most = 0;            // steps
  double enough = 0.0;     // scaling_energy() at which there is no need for more
};

// A metric that goes on in double beside the input's.
class CarriedMetric : public LoopedMetric {
 public:
  // `carried`: on the final triangulation of `metric`, from which this goes on.
  CarriedMetric(const conformal::ConformalMetric& metric, const PennerTargets& targets,
                intrinsic::LoopCarrier carried, ExecutionContext& context);

  // False where doubles lead to no Delaunay triangulation. Nothing else may be asked for then.
  bool started() const { return engine->started(); }
  PennerRun meet(const PennerTargets& targets, Meeting how, const PennerNewtonOptions& options,
                 ExecutionContext& context);
  // Brings it nearer to the input's, step by step, each of which meets the angles again; ends where
  // none leads nearer in the coordinates of the current triangulation. `area`: of the vertices, for
  // the energy. Returns the number of steps. Precondition: the targets are met. Cost: some linear
  // systems a step.
  int come_near(const PennerTargets& targets, Meeting how, const Nearing& options,
                const std::vector<double>& area, ExecutionContext& context);
  void append_to(conformal::ConformalMetric& metric, const ExecutionContext& context) const;

 private:
  // The logarithms of lengths over the input's.
  std::vector<double> ratios() const { return reference_.ratios(engine->lengths()); }
  double distance() const;
  void follow(const ExecutionContext& context);

  ReferenceMetric reference_;
  std::size_t referred_ = 0;  // flips of the engine that the reference has taken
};

}  // namespace flipfree::seamless
