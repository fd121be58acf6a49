// Newton's method for cone and loop angles on a metric that is kept Delaunay by Ptolemy flips.
//
// Ptolemy flips are exact changes of coordinates of the space of metrics, so every step is taken in
// the edge lengths of the triangulation that is Delaunay at the moment, and loops are carried
// along.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/newton_system.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::seamless {

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
// copies'), vertices are the user's, and s is symmetric (bordered/symmetric_changes.h).

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

}  // namespace flipfree::seamless
