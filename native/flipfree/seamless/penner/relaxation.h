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
#include <utility>
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
// Unlike penner_newton.h it counts conformal changes as well: it is what keeps a metric near
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

// The metric so far as the start of an engine.
conformal::EngineInput start_of(const conformal::ConformalMetric& metric,
                                const std::vector<double>& target);
// What an engine that started there reached, appended to it.
void append(const conformal::MetricEngine& engine, conformal::ConformalMetric& metric,
            const ExecutionContext& context);

// A metric that goes on in double, with what is carried through its flips.
class CarriedMetric {
 public:
  // `loops`: on the final triangulation of `metric`, from which this goes on.
  CarriedMetric(const conformal::ConformalMetric& metric, const PennerTargets& targets,
                intrinsic::LoopCarrier loops, ExecutionContext& context);

  // False where doubles lead to no Delaunay triangulation. Nothing else may be asked for then.
  bool started() const { return engine_->started(); }
  CarriedMetric copy() const { return *this; }
  PennerRun meet(const PennerTargets& targets, Meeting how, const PennerNewtonOptions& options,
                 ExecutionContext& context);
  // The shortest change that leads to the input's metric to first order, the angles kept; empty if
  // there is none.
  std::vector<double> way_back(const PennerTargets& targets, ShortestSystem& system,
                               ExecutionContext& context) const;
  // Changes the logarithms of all lengths by `step` times these. False if it could not follow.
  bool stretch(const std::vector<double>& direction, double step, ExecutionContext& context);

  PennerAngles angles(const PennerTargets& targets, ExecutionContext& context) const;
  // Scale factors of the user's vertices.
  std::vector<double> scale() const;
  // Sum of the squares of the logarithms of lengths over the input's.
  double distance() const;
  const intrinsic::LoopCarrier& loops() const { return loops_; }
  // Goes on where `metric` ended, from which this started.
  void append_to(conformal::ConformalMetric& metric, const ExecutionContext& context) const;

 private:
  struct Engine {  // copied by its state
    std::unique_ptr<conformal::MetricEngine> own;
    Engine(std::unique_ptr<conformal::MetricEngine> engine) : own(std::move(engine)) {}
    Engine(const Engine& other) : own(other.own->copy()) {}
    Engine(Engine&&) = default;
    Engine& operator=(Engine&&) = default;
    conformal::MetricEngine* operator->() const { return own.get(); }
  };
  void follow(ExecutionContext& context);

  std::shared_ptr<const conformal::EngineInput> input_;  // which engines read to their end
  Engine engine_;
  intrinsic::LoopCarrier loops_;
  ReferenceMetric reference_;
  std::size_t followed_ = 0;  // flips of the engine that the reference has taken
};

struct Nearing {
  double tolerance = 0.0;  // of all angles after a step
  int most = 0;            // steps
  double enough = 0.0;     // scaling_energy() at which there is no need for more
};

// Brings a metric nearer to the input's, step by step, each of which meets the angles again; ends
// where none leads nearer in the coordinates of the current triangulation. `area`: of the vertices,
// for the energy. Returns the number of steps. Precondition: the targets are met. Cost: some linear
// systems a step.
int come_near(CarriedMetric& metric, const PennerTargets& targets, Meeting how,
              const Nearing& options, const std::vector<double>& area, ExecutionContext& context);

}  // namespace flipfree::seamless
