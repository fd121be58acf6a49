// Newton's method for cone and loop angles on a metric that is kept Delaunay by Ptolemy flips.
//
// Ptolemy flips are exact changes of coordinates of the space of metrics, so every step is taken in
// the edge lengths of the triangulation that is Delaunay at the moment, and loops are carried
// along.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/newton_system.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::seamless {

// Changes of edge lengths that keep the metric of a double cover symmetric.
//
// An edge and its mirror image change alike, and the diagonal d of a symmetric quadrilateral
// follows from its legs l and its parallel sides w, v by d^2 = l^2 + w v (flip_lengths.h). All
// equations of a symmetric metric can be asked in these coordinates instead of the edges.

// #E x (free edges): the change of the logarithms of all lengths by unit changes of the free ones.
// Orthonormal columns but for the rows of diagonals. `cotangent`: per half-edge, of the angle
// opposite. Precondition: mesh.symmetric(). Cost: O(#E).
numeric::SparseMatrix symmetric_changes(const intrinsic::IntrinsicMesh& mesh,
                                        const std::vector<double>& cotangent);

// How much a face of the mesh counts for the angles of the surface: the two copies of a double
// cover half each.
inline double face_share(const intrinsic::IntrinsicMesh& mesh) {
  return mesh.symmetric() ? 0.5 : 1.0;
}

// Newton's equations for cone angles and loop angles in the logarithms of the edge lengths of the
// current triangulation (Capouellez, Zorin 2024, "Seamless Parametrization in Penner Coordinates").
//
// Unknowns outnumber equations; the paper takes the shortest step. Here a step is the sum of a
// conformal one, u_i at every vertex, which costs nothing, and a stretch s_e of every edge, which
// is the shortest: d_e = (u_i + u_j) / 2 + s_e. So the metric leaves the conformal class of the
// input no further than the loops ask, and all that has to be factorized is the cotangent Laplacian
// H, whatever the genus.
//
// Letters: Jv, Jl derivatives of vertex and loop angles, B u = (u_i + u_j) / 2, so Jv B = -H;
// g, f what vertices and loops lack. Minimal s'D^-1 s under Jv d = g, Jl d = f gives s = D Q c with
//
//     Q = Jl' - Jv' X,  X = -H^-1 B' Jl',   (Q' D Q) c = f - X' g,   u = H^-1 (Jv s - g).
//
// The columns of Q sum to zero around every vertex, depend on the homology classes of the loops
// only, and are independent as these are: there is one step for any basis.
//
// On the double cover of a surface with boundary, angles are those of the surface (half of both
// copies'), vertices are the user's, and s is symmetric (symmetric_changes()).

// What is prescribed.
struct PennerTargets {
  std::vector<double> vertex_angle;  // #V of the user's surface
  std::vector<double> loop_angle;    // #loops
};

// A promise of all that iterate: the loops run in the engine's triangulation (asked with
// sanitizers).
void require_same_mesh(const conformal::MetricEngine& engine, const intrinsic::LoopCarrier& loops);

// The angles of a metric against what is prescribed.
struct PennerAngles {
  std::vector<double> cotangent;  // #H: of the angle opposite each half-edge
  conformal::Gradient vertices;   // value: target - angle; half cotangents
  std::vector<double> loops;      // target - angle
  double max_error = 0.0;         // of both; infinite if an angle is no number
  double norm = 0.0;              // of both
};
void measure(const conformal::MetricEngine& engine, const intrinsic::LoopCarrier& loops,
             const PennerTargets& targets, PennerAngles& out, ExecutionContext& context);

struct PennerDirection {
  std::vector<double> scale;    // #V: u
  std::vector<double> stretch;  // #E: s
  double scale_range = 0.0;
  double most_stretch = 0.0;
};

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;
// Derivatives of the vertices' angles, Jv', #E x #V.
SparseRows vertex_derivatives(const intrinsic::IntrinsicMesh& mesh, Eigen::Index vertex_count,
                              const std::vector<double>& cotangent);
// Derivatives of the loops' angles, #E x #loops, column by column sorted by row.
numeric::SparseMatrix loop_derivatives(const intrinsic::IntrinsicMesh& mesh,
                                       const intrinsic::LoopCarrier& loops,
                                       const std::vector<double>& cotangent);

class PennerSystem {
 public:
  // False if the Laplacian is not positive definite to working precision or an angle has no
  // cotangent. Cost: that of prepare().
  bool solve(const intrinsic::IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
             const PennerAngles& angles, PennerDirection& direction, ExecutionContext& context);

  // What of it depends on the metric alone. Cost: a factorization, 2 g solutions, O(g^2 #E).
  bool prepare(const intrinsic::IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
               const PennerAngles& angles, ExecutionContext& context);

  // What it costs to turn loops by e more, e' N e: the square of the length of the shortest stretch
  // that does it. N, #loops x #loops. Precondition: prepare() returned true, for one loop or more.
  Eigen::MatrixXd norm_of_turns() const;

  // Lent for conformal changes of the metric, with its order and memory; prepare() comes next.
  conformal::NewtonSystem& laplacian() { return laplacian_; }

 private:
  conformal::NewtonSystem laplacian_;
  // Kept from step to step for their memory; of gram_ only the lower half is set.
  Eigen::MatrixXd x_, q_, gram_;
  SparseRows vertex_derivatives_;
  numeric::SparseMatrix symmetric_;
};

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

// Halves a step, from `first` on while it is longer than `least`, until the norm of all errors
// falls (Armijo). move(step) changes the engine, false if it could not follow. `angles`: before and
// after; false, and everything is as it was, if no step does.
bool descend(conformal::MetricEngine& engine, intrinsic::LoopCarrier& loops,
             const PennerTargets& targets, double first, double least,
             const std::function<bool(double step)>& move, PennerAngles& angles,
             ExecutionContext& context);

// Iterates from the engine's present state. `loops` holds the loops in the engine's triangulation,
// before and after. The norm of all errors falls with every step. Throws Cancelled, TimeIsOver.
PennerRun run_penner(std::unique_ptr<conformal::MetricEngine>& engine,
                     intrinsic::LoopCarrier& loops, const PennerTargets& targets,
                     const PennerNewtonOptions& options, ExecutionContext& context);

// Brings a metric nearer to that of the input while its cones and loops stay as they are.
//
// The conformal metric of cones where the surface has no curvature spans many orders of magnitude:
// more than doubles hold as a map, and more than an optimisation of the map would like to start
// from. Lengths that are not conformal need not. The distance is that of the logarithms of edge
// lengths on the current triangulation, on which the input's metric is given by its Penner lengths
// (Capouellez, Zorin 2023, "Metric Optimization in Penner Coordinates"). It changes with the
// triangulation, so nothing is minimised strictly: a few steps do nearly all.

// The shortest change of the logarithms of edge lengths that meets the linearised equations for
// cone and loop angles (Capouellez, Zorin 2024): d = w + J' m with J d = g, nearest to a wish w.
//
// Unlike PennerSystem it counts conformal changes as well: it is what keeps a metric near
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
// The way from the conformal metric (run_penner()) is shorter, refines less and keeps to the
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
