#include "flipfree/seamless/penner/penner_newton.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/conformal/newton.h"
#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::seamless {

using conformal::FineVector;
using conformal::MetricEngine;
using intrinsic::EdgeLabel;
using intrinsic::IntrinsicMesh;

namespace {

// Changes of edge lengths that keep the metric of a double cover symmetric.
//
// An edge and its mirror image change alike, and the diagonal d of a symmetric quadrilateral
// follows from its legs l and its parallel sides w, v by d^2 = l^2 + w v (delaunay_metric.h). All
// equations of a symmetric metric can be asked in these coordinates instead of the edges.

// Per edge its column, and with what factor; none for diagonals.
struct Columns {
  std::vector<Index> of;
  std::vector<double> factor;
  Index count = 0;
};

Columns number_columns(const IntrinsicMesh& mesh) {
  Columns columns{std::vector<Index>(mesh.edge_count(), kInvalid),
                  std::vector<double>(mesh.edge_count(), 0.0)};
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    const EdgeLabel label = mesh.label_of_edge(static_cast<EdgeId>(e));
    if (label == EdgeLabel::kDiagonal || label == EdgeLabel::kTwo) continue;
    columns.of[e] = columns.count++;
    columns.factor[e] = 1.0;
    if (label != EdgeLabel::kOne) continue;
    const std::size_t mirror = at(mesh.reflection[2 * e] >> 1);
    columns.of[mirror] = columns.of[e];
    columns.factor[e] = columns.factor[mirror] = 1.0 / std::numbers::sqrt2;
  }
  return columns;
}

// #E x (free edges): the change of the logarithms of all lengths by unit changes of the free ones.
// Orthonormal columns but for the rows of diagonals. `cotangent`: per half-edge, of the angle
// opposite. Precondition: mesh.symmetric(). Cost: O(#E).
numeric::SparseMatrix symmetric_changes(const IntrinsicMesh& mesh,
                                        const std::vector<double>& cotangent) {
  const Columns columns = number_columns(mesh);
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(2 * mesh.edge_count());
  const auto add = [&](std::size_t row, EdgeId side, double share) {
    entries.emplace_back(static_cast<Index>(row), columns.of[at(side)],
                         share * columns.factor[at(side)]);
  };
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    const auto edge = static_cast<EdgeId>(e);
    if (mesh.label_of_edge(edge) != EdgeLabel::kDiagonal) {
      add(e, edge, 1.0);
      continue;
    }
    for (const HalfedgeId d : {2 * edge, 2 * edge + 1}) {
      HalfedgeId leg = mesh.next_of(d), across = mesh.previous(d);
      if (mesh.label_of_edge(leg >> 1) == EdgeLabel::kPerpendicular) std::swap(leg, across);
      // (leg / diagonal)^2 by the law of sines.
      const double c = cotangent[at(d)], l = cotangent[at(leg)];
      const double share = (1.0 + c * c) / (1.0 + l * l);
      add(e, leg >> 1, 0.5 * share);
      add(e, across >> 1, 0.5 * (1.0 - share));
    }
  }
  numeric::SparseMatrix matrix(static_cast<Index>(mesh.edge_count()), columns.count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// How much a face of the mesh counts for the angles of the surface: the two copies of a double
// cover half each.
double face_share(const intrinsic::IntrinsicMesh& mesh) { return mesh.symmetric() ? 0.5 : 1.0; }

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

constexpr std::size_t kFacesPerChunk = 4096;

// The sides after a half-edge in its face.
struct OtherSides {
  std::size_t next, previous;
};
OtherSides other_sides(const IntrinsicMesh& mesh, std::size_t h) {
  const HalfedgeId n = mesh.next[h];
  return {at(n), at(mesh.next[at(n)])};
}

Index unknown_at(const IntrinsicMesh& mesh, std::size_t h) {
  return mesh.unknown[at(mesh.origin[h])];
}

// B' r, column by column.
Eigen::MatrixXd by_vertices(const IntrinsicMesh& mesh, Eigen::Index vertex_count,
                            const numeric::SparseMatrix& r) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(vertex_count, r.cols());
  for (Index i = 0; i < r.cols(); ++i) {
    for (numeric::SparseMatrix::InnerIterator entry(r, i); entry; ++entry) {
      const std::size_t h = 2 * at(entry.index());
      a(unknown_at(mesh, h), i) += 0.5 * entry.value();
      a(unknown_at(mesh, h + 1), i) += 0.5 * entry.value();
    }
  }
  return a;
}

// Columns that sum to zero, as right-hand sides of the Laplacian must: what rounding adds would all
// land on the fixed vertex.
void remove_means(Eigen::MatrixXd& columns) {
  columns.rowwise() -= columns.colwise().mean().eval();
}

struct PennerDirection {
  std::vector<double> scale;    // #V: u
  std::vector<double> stretch;  // #E: s
  double scale_range = 0.0;
  double most_stretch = 0.0;
};

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;
// Derivatives of the vertices' angles, Jv', #E x #V.
SparseRows vertex_derivatives(const IntrinsicMesh& mesh, Eigen::Index vertex_count,
                              const std::vector<double>& cotangent) {
  const double share = face_share(mesh);
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(3 * cotangent.size());
  for (std::size_t h = 0; h < cotangent.size(); ++h) {
    const auto [n, p] = other_sides(mesh, h);
    const auto e = static_cast<Index>(h / 2);
    entries.emplace_back(e, unknown_at(mesh, p), share * (cotangent[n] + cotangent[p]));
    entries.emplace_back(e, unknown_at(mesh, h), -share * cotangent[p]);
    entries.emplace_back(e, unknown_at(mesh, n), -share * cotangent[n]);
  }
  SparseRows j(static_cast<Index>(mesh.edge_count()), static_cast<Index>(vertex_count));
  j.setFromTriplets(entries.begin(), entries.end());
  return j;
}

// Derivatives of the loops' angles, #E x #loops, column by column sorted by row.
numeric::SparseMatrix loop_derivatives(const IntrinsicMesh& mesh,
                                       const intrinsic::LoopCarrier& loops,
                                       const std::vector<double>& cotangent) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto column = static_cast<Index>(i);
    loops.visit_corners(i, [&](const intrinsic::PassedCorner& corner) {
      const auto h = at(corner.opposite);
      const auto [n, p] = other_sides(mesh, h);
      const auto add = [&](std::size_t g, double value) {
        entries.emplace_back(static_cast<Index>(g / 2), column, corner.sign * value);
      };
      add(h, cotangent[n] + cotangent[p]);
      add(n, -cotangent[p]);
      add(p, -cotangent[n]);
    });
  }
  numeric::SparseMatrix r(static_cast<Index>(mesh.edge_count()), static_cast<Index>(loops.size()));
  r.setFromTriplets(entries.begin(), entries.end());
  return r;
}

}  // namespace

LoopedMetric::LoopedMetric(const conformal::ConformalMetric& metric, const PennerTargets& targets,
                           intrinsic::LoopCarrier carried, int bits, ExecutionContext& context)
    : loops(std::move(carried)) {
  conformal::EngineInput start;
  start.setup = {metric.mesh, metric.input_halfedge, metric.on_boundary};
  start.vertex_count = static_cast<Index>(targets.vertex_angle.size());
  start.edge_length = intrinsic::to_doubles(metric.length);
  start.target = targets.vertex_angle;
  input = std::make_shared<const conformal::EngineInput>(std::move(start));
  engine = make_engine(*input, bits, context);
  follow(context);
}

void LoopedMetric::follow(const ExecutionContext& context) {
  const std::vector<intrinsic::FlipRecord>& flips = engine->flips();
  for (; followed < flips.size(); ++followed) {
    // A flip costs as much as it has crossings with the loops, which grow with every flip.
    context.check();
    for (const EdgeId e : flips[followed].plain) loops.flip(e);
  }
}

PennerAngles measure(const LoopedMetric& metric, const PennerTargets& targets,
                     ExecutionContext& context) {
  const IntrinsicMesh& mesh = metric.mesh();
  PennerAngles out;
  std::vector<double> tangent;
  metric.engine->half_tangents(tangent, context);
  const std::size_t count = tangent.size();
  out.cotangent.resize(count);
  out.vertices.half_cotangent.resize(count);
  std::vector<double> angle(count);
  const double share = face_share(mesh);
  parallel_for(context, count, 3 * kFacesPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 for (std::size_t h = begin; h < end; ++h) {
                   const double t = tangent[h];
                   angle[h] = 2.0 * std::atan(t);
                   out.cotangent[h] = 0.5 * (1.0 / t - t);
                   out.vertices.half_cotangent[h] = 0.5 * share * out.cotangent[h];
                 }
               });
  out.vertices.value = targets.vertex_angle;
  for (std::size_t h = 0; h < count; ++h)
    out.vertices.value[at(unknown_at(mesh, other_sides(mesh, h).previous))] -= share * angle[h];
  out.loops = targets.loop_angle;
  for (std::size_t i = 0; i < out.loops.size(); ++i) {
    metric.loops.visit_corners(i, [&](const intrinsic::PassedCorner& corner) {
      out.loops[i] -= corner.sign * angle[at(corner.opposite)];
    });
  }
  double largest = 0.0, squares = 0.0;
  for (const auto* errors : {&out.vertices.value, &out.loops}) {
    for (const double error : *errors) {
      const double size =
          std::isfinite(error) ? std::abs(error) : std::numeric_limits<double>::infinity();
      largest = std::max(largest, size);
      squares += size * size;
    }
  }
  out.vertices.max_error = largest;
  out.max_error = largest;
  out.norm = std::sqrt(squares);
  return out;
}

namespace {

class PennerSystem {
 public:
  // False if the Laplacian is not positive definite to working precision or an angle has no
  // cotangent. Cost: that of prepare().
  bool solve(const LoopedMetric& metric, const PennerAngles& angles, PennerDirection& direction,
             ExecutionContext& context) {
    if (!prepare(metric, angles, context)) return false;
    const IntrinsicMesh& mesh = metric.mesh();
    const auto vertex_count = static_cast<Eigen::Index>(angles.vertices.value.size());
    const Eigen::Map<const Eigen::VectorXd> g(angles.vertices.value.data(), vertex_count);
    Eigen::MatrixXd right = -g;
    Eigen::VectorXd s = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(mesh.edge_count()));
    if (!angles.loops.empty()) {
      const Eigen::Map<const Eigen::VectorXd> f(angles.loops.data(),
                                                static_cast<Eigen::Index>(angles.loops.size()));
      s = q_ * Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower>(gram_).solve(f - x_.transpose() * g);
      if (mesh.symmetric()) s = symmetric_ * s.eval();
      right += vertex_derivatives_.transpose() * s;
    }
    remove_means(right);
    const Eigen::MatrixXd u = laplacian_.solve_columns(right, context);
    direction.scale.assign(u.data(), u.data() + vertex_count);
    direction.stretch.assign(s.data(), s.data() + s.size());
    direction.scale_range = u.maxCoeff() - u.minCoeff();
    direction.most_stretch = s.cwiseAbs().maxCoeff();
    const double middle = 0.5 * (u.maxCoeff() + u.minCoeff());
    for (double& value : direction.scale) value -= middle;
    return std::isfinite(direction.scale_range) && std::isfinite(direction.most_stretch);
  }
  // What of it depends on the metric alone. Cost: a factorization, 2 g solutions, O(g^2 #E).
  bool prepare(const LoopedMetric& metric, const PennerAngles& angles, ExecutionContext& context) {
    const IntrinsicMesh& mesh = metric.mesh();
    if (!std::isfinite(angles.max_error)) return false;
    if (!laplacian_.factorize(mesh, angles.vertices, context)) return false;
    if (metric.loops.size() == 0) return true;
    const auto vertex_count = static_cast<Eigen::Index>(angles.vertices.value.size());
    const numeric::SparseMatrix r = loop_derivatives(mesh, metric.loops, angles.cotangent);
    Eigen::MatrixXd a = by_vertices(mesh, vertex_count, r);
    remove_means(a);
    x_ = -laplacian_.solve_columns(a, context);
    SparseRows derivatives = vertex_derivatives(mesh, vertex_count, angles.cotangent);
    vertex_derivatives_.swap(derivatives);
    q_ = Eigen::MatrixXd(r) - vertex_derivatives_ * x_;
    if (mesh.symmetric()) {
      numeric::SparseMatrix symmetric = symmetric_changes(mesh, angles.cotangent);
      symmetric_.swap(symmetric);
      q_ = symmetric_.transpose() * q_.eval();
    }
    gram_.setZero(q_.cols(), q_.cols());
    gram_.selfadjointView<Eigen::Lower>().rankUpdate(q_.transpose());
    return true;
  }
  Eigen::MatrixXd turn_norm() const {
    return Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower>(gram_).solve(
        Eigen::MatrixXd::Identity(gram_.rows(), gram_.cols()));
  }
  // Lent for conformal changes of the metric, with its order and memory; prepare() comes next.
  conformal::NewtonSystem& laplacian() { return laplacian_; }

 private:
  conformal::NewtonSystem laplacian_;
  // Kept from step to step for their memory; of gram_ only the lower half is set.
  Eigen::MatrixXd x_, q_, gram_;
  SparseRows vertex_derivatives_;
  numeric::SparseMatrix symmetric_;
};

// Sufficient decrease (Armijo): the share of what a step promises to first order that it must
// reach.
constexpr double kArmijo = 1e-4;
constexpr double kSmallestRestoredStep = 1e-4;
// A step changes no logarithm of an edge by more than this beside the conformal part, and no
// difference of scale factors by more than that.
constexpr double kMostStretch = 2.0, kMostScaleRange = 10.0;
// Below the tolerance iterations go on while each gains this much: the last step of a quadratically
// converging iteration costs little and brings the angles to rounding.
constexpr double kWorthwhileGain = 0.1;
// A line search that cuts its step to this share fights the cones, not the loops: from then on,
// until a whole step is taken, every step meets the cones again before it is judged.
constexpr double kShortStep = 0.25;
// How well cones are met then: share of the loops' error.
constexpr double kCones = 1e-2;
constexpr int kConeIterations = 50;
// Steps after each of which the cones were met again that leave more than half of the error are a
// stall.
constexpr std::size_t kPatience = 5;
double norm_of(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double x : values) squares += x * x;
  return std::sqrt(squares);
}

double largest_of(const std::vector<double>& values) {
  double largest = 1e-300;
  for (const double x : values) largest = std::max(largest, std::abs(x));
  return largest;
}

// Changes the logarithms of all lengths by `step` times these. False if it could not follow.
bool stretch_by(MetricEngine& engine, const std::vector<double>& direction, double step,
                ExecutionContext& context) {
  std::vector<double> part = direction;
  for (double& d : part) d *= step;
  engine.stretch(part, context);
  return engine.restore_delaunay(context);
}

// Halves a step, from `first` on while it is longer than `least`, until attempt(trial, step), which
// changes a copy of the metric, is taken. False, and the metric is as it was, if no step is.
template <typename Metric, typename Attempt>
bool take_halved(Metric& metric, double first, double least, const Attempt& attempt) {
  for (double step = first; step > least; step *= 0.5) {
    Metric trial = metric;
    if (!attempt(trial, step)) continue;
    metric = std::move(trial);
    return true;
  }
  return false;
}

// The same, of the metric itself, until the norm of all errors falls (Armijo). move(step) changes
// the engine, false if it could not follow; an engine that goes back rounds its lengths anew.
// `angles`: before and after.
template <typename Move>
bool descend(LoopedMetric& metric, const PennerTargets& targets, double first, double least,
             const Move& move, PennerAngles& angles, ExecutionContext& context) {
  const intrinsic::LoopCarrier saved = metric.loops;
  const std::size_t followed = metric.followed;
  metric.engine->remember();
  for (double step = first; step > least; step *= 0.5) {
    if (move(step)) {
      metric.follow(context);
      PennerAngles trial = measure(metric, targets, context);
      if (trial.norm < (1.0 - kArmijo * step) * angles.norm) {
        angles = std::move(trial);
        return true;
      }
    }
    metric.engine->go_back();
    metric.loops = saved;
    metric.followed = followed;
  }
  return false;
}

// Iterates while step(), which changes the metric and `angles`, goes on: to the tolerance, and with
// `polish` on from there.
template <typename Step>
void iterate(LoopedMetric& metric, const PennerTargets& targets, const PennerNewtonOptions& options,
             bool polish, PennerAngles& angles, PennerRun& run, const Step& step,
             ExecutionContext& context) {
  debug_require("loops and metric", "they have one triangulation",
                [&] { return metric.loops.mesh().next == metric.mesh().next; });
  angles = measure(metric, targets, context);
  run.error_history.push_back(angles.max_error);
  double before = std::numeric_limits<double>::infinity();
  while (angles.max_error > options.tolerance ||
         (polish && angles.max_error < kWorthwhileGain * before)) {
    if (angles.max_error == 0.0) break;
    run.end = PennerEnd::kIterations;
    if (run.iterations >= options.max_iterations) break;
    context.check();
    before = angles.max_error;
    run.end = PennerEnd::kStalled;
    if (!step()) break;
    ++run.iterations;
    run.error_history.push_back(angles.max_error);
  }
  if (angles.max_error <= options.tolerance) run.end = PennerEnd::kConverged;
  run.error = angles.max_error;
}

class PennerNewton {
 public:
  PennerNewton(LoopedMetric& metric, const PennerTargets& targets,
               const PennerNewtonOptions& options, ExecutionContext& context)
      : at_(metric), targets_(targets), options_(options), context_(context) {}

  PennerRun run() {
    const auto step = [&] {
      return solve() && !no_progress() && (restoring_ ? restored_step() : plain_step());
    };
    iterate(at_, targets_, options_, true, angles_, run_, step, context_);
    return std::move(run_);
  }

 private:
  bool solve() { return system_.solve(at_, angles_, direction_, context_); }

  bool no_progress() const {
    const std::size_t now = run_.error_history.size();
    return run_.restored > static_cast<int>(kPatience) &&
           run_.error_history[now - 1] > 0.5 * run_.error_history[now - 1 - kPatience];
  }

  double first_step() const {
    return std::min({1.0, kMostStretch / std::max(direction_.most_stretch, 1e-300),
                     kMostScaleRange / std::max(direction_.scale_range, 1e-300)});
  }

  // Changes the engine by `step` times the direction. False if it could not follow.
  bool move(MetricEngine& engine, double step) {
    FineVector scale;
    scale.high.reserve(direction_.scale.size());
    for (const double u : direction_.scale) scale.high.push_back(0.5 * step * u);
    engine.scale(scale, context_);
    return stretch_by(engine, direction_.stretch, step, context_);
  }

  bool plain_step() {
    const double first = first_step();
    const auto move_by = [&](double step) { return move(*at_.engine, step); };
    if (descend(at_, targets_, first, kShortStep * first, move_by, angles_, context_)) return true;
    if (angles_.max_error <= options_.tolerance) return false;
    restoring_ = true;
    return restore_here() && (angles_.max_error <= options_.tolerance || restored_step());
  }

  // Meets the cones by conformal changes alone.
  bool meet_cones(LoopedMetric& metric, double loop_error) {
    conformal::NewtonOptions newton;
    newton.tolerance = std::max(0.1 * options_.tolerance, kCones * loop_error);
    newton.max_iterations = kConeIterations;
    conformal::Descent descent = conformal::Descent::kLineSearch;
    if (run_newton(*metric.engine, system_.laplacian(), newton, descent, context_).end !=
        conformal::NewtonEnd::kConverged)
      return false;
    metric.follow(context_);
    return true;
  }

  bool restore_here() {
    if (norm_of(angles_.vertices.value) <= kCones * norm_of(angles_.loops)) return true;
    LoopedMetric trial = at_;
    if (!meet_cones(trial, norm_of(angles_.loops))) return false;
    at_ = std::move(trial);
    angles_ = measure(at_, targets_, context_);
    return solve();
  }

  // Until the loops' error falls where the cones are met again.
  bool restored_step() {
    const double first = first_step();
    const double before = norm_of(angles_.loops);
    return take_halved(at_, first, kSmallestRestoredStep * first,
                       [&](LoopedMetric& trial, double step) {
                         if (!move(*trial.engine, step) || !meet_cones(trial, before)) return false;
                         PennerAngles angles = measure(trial, targets_, context_);
                         if (!(norm_of(angles.loops) < (1.0 - kArmijo * step) * before))
                           return false;
                         angles_ = std::move(angles);
                         ++run_.restored;
                         restoring_ = step < 1.0;
                         return true;
                       });
  }

  LoopedMetric& at_;
  const PennerTargets& targets_;
  const PennerNewtonOptions& options_;
  ExecutionContext& context_;
  PennerSystem system_;
  PennerAngles angles_;
  PennerDirection direction_;
  bool restoring_ = false;
  PennerRun run_;
};

// The shortest change of the logarithms of edge lengths that meets the linearised equations for
// cone and loop angles (Capouellez, Zorin 2024): d = w + J' m with J d = g, nearest to a wish w.
//
// Unlike PennerSystem it counts conformal changes as well: it is what keeps a metric near
// another one, and what has to be factorized is J J', with twelve neighbours a vertex.

// Empty if J J' is not positive definite to working precision. `wish`: per edge. Cost: an analysis
// and a factorization of the vertices' part, O(genus) solutions; loops enter by their Schur
// complement.
std::vector<double> shortest_change(const LoopedMetric& metric, const PennerAngles& angles,
                                    const std::vector<double>& wish, ExecutionContext& context) {
  const IntrinsicMesh& mesh = metric.mesh();
  const auto vertex_count = static_cast<Eigen::Index>(angles.vertices.value.size());
  const Eigen::Index n = vertex_count - 1;
  const SparseRows jt = vertex_derivatives(mesh, vertex_count, angles.cotangent);
  SparseRows cut = jt.leftCols(n);
  numeric::SparseMatrix symmetric;
  if (mesh.symmetric()) {
    symmetric = symmetric_changes(mesh, angles.cotangent);
    cut = SparseRows(symmetric.transpose()) * cut;
  }
  const numeric::SparseMatrix rows = numeric::SparseMatrix(cut.transpose());
  numeric::SparseMatrix product = rows * cut;
  product.makeCompressed();
  numeric::SparseMatrix lower = product.triangularView<Eigen::Lower>();
  lower.makeCompressed();
  numeric::SparseCholesky cholesky;
  cholesky.analyze(lower, context);
  if (!cholesky.factorize(lower, context)) return {};
  Eigen::VectorXd w =
      Eigen::Map<const Eigen::VectorXd>(wish.data(), static_cast<Eigen::Index>(wish.size()));
  if (mesh.symmetric()) {
    for (Eigen::Index e = 0; e < w.size(); ++e) {
      if (mesh.label_of_edge(static_cast<EdgeId>(e)) == intrinsic::EdgeLabel::kDiagonal) w[e] = 0.0;
    }
    w = symmetric.transpose() * w.eval();
  }
  const Eigen::Map<const Eigen::VectorXd> g(angles.vertices.value.data(), n);
  const Eigen::VectorXd right = g - rows * w;
  Eigen::VectorXd d = w;
  if (metric.loops.size() > 0) {
    numeric::SparseMatrix q = loop_derivatives(mesh, metric.loops, angles.cotangent);
    if (mesh.symmetric()) q = numeric::SparseMatrix(symmetric.transpose() * q);
    const Eigen::MatrixXd mixed = rows * q;
    const Eigen::MatrixXd x = cholesky.solve(mixed, context);
    const Eigen::Map<const Eigen::VectorXd> f(angles.loops.data(),
                                              static_cast<Eigen::Index>(metric.loops.size()));
    const Eigen::MatrixXd schur = Eigen::MatrixXd(q.transpose() * q) - mixed.transpose() * x;
    const Eigen::VectorXd m =
        numeric::solve_symmetric(schur, f - q.transpose() * w - x.transpose() * right);
    d += q * m;
    const Eigen::VectorXd rest = right - mixed * m;
    d += cut * cholesky.solve(rest, context);
  } else {
    d += cut * cholesky.solve(right, context);
  }
  if (mesh.symmetric()) d = symmetric * d.eval();
  return d.allFinite() ? std::vector<double>(d.begin(), d.end()) : std::vector<double>{};
}

// Newton's method for cone and loop angles by the shortest steps, from the input's own metric
// (Capouellez, Zorin 2024, Algorithm 1, in the coordinates of the current triangulation).
//
// The way from the conformal metric (run_penner()) is shorter, refines less and keeps to the
// shape. But where cones are far from a handle, that handle is exponentially large in the conformal
// metric, its loops turn by next to nothing, and making it larger still brings them nearer to
// nothing for free, with no end. Here every change of a length costs.

// As run_penner(). Loses its quadratic end to rounding earlier: run_penner() may follow.
PennerRun run_shortest(LoopedMetric& metric, const PennerTargets& targets,
                       const PennerNewtonOptions& options, ExecutionContext& context) {
  constexpr double kMostNewtonChange = 1.0;  // of a logarithm of a length in one step
  constexpr double kLeastShareOfStep = 1e-3;
  PennerRun run;
  PennerAngles angles;
  const std::vector<double> no_wish(metric.mesh().edge_count(), 0.0);
  const auto step = [&] {
    const std::vector<double> change = shortest_change(metric, angles, no_wish, context);
    if (change.empty()) return false;
    const double first = std::min(1.0, kMostNewtonChange / largest_of(change));
    const auto move = [&](double by) { return stretch_by(*metric.engine, change, by, context); };
    return descend(metric, targets, first, kLeastShareOfStep * first, move, angles, context);
  };
  iterate(metric, targets, options, false, angles, run, step, context);
  return run;
}

// log(exp(a) + exp(b)).
double log_sum(double a, double b) {
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

}  // namespace

Eigen::MatrixXd norm_of_turns(const LoopedMetric& metric, const PennerAngles& angles,
                              ExecutionContext& context) {
  PennerSystem system;
  const auto count = static_cast<Eigen::Index>(metric.loops.size());
  return count > 0 && system.prepare(metric, angles, context)
             ? system.turn_norm()
             : Eigen::MatrixXd::Identity(count, count);
}

PennerRun run_penner(LoopedMetric& metric, const PennerTargets& targets,
                     const PennerNewtonOptions& options, ExecutionContext& context) {
  return PennerNewton(metric, targets, options, context).run();
}

ReferenceMetric::ReferenceMetric(const intrinsic::FlippedMetric& metric) {
  std::vector<double> length = intrinsic::to_doubles(metric.initial_length);
  mesh_ = metric.initial;
  for (std::size_t i = 0; i < metric.euclidean_flips; ++i) {
    for (const EdgeId e : metric.flips[i].plain) {
      length[at(e)] = intrinsic::euclidean_flip(mesh_, length, e);
      intrinsic::flip_edge(mesh_, e);
    }
  }
  logarithm_.reserve(length.size());
  for (const double l : length) logarithm_.push_back(std::log(l));
  for (std::size_t i = metric.euclidean_flips; i < metric.flips.size(); ++i) {
    for (const EdgeId e : metric.flips[i].plain) flip(e);
  }
}

void ReferenceMetric::flip(EdgeId e) {
  const HalfedgeId h = 2 * e, o = h + 1;
  const auto of = [&](HalfedgeId g) { return logarithm_[at(g >> 1)]; };
  const double a = of(mesh_.next_of(h)) + of(mesh_.next_of(o));
  const double b = of(mesh_.previous(h)) + of(mesh_.previous(o));
  logarithm_[at(e)] = log_sum(a, b) - logarithm_[at(e)];
  intrinsic::flip_edge(mesh_, e);
}

std::vector<double> ReferenceMetric::ratios(const std::vector<double>& lengths) const {
  std::vector<double> r(lengths.size());
  double mean = 0.0;
  for (std::size_t e = 0; e < r.size(); ++e) {
    r[e] = std::log(lengths[e]) - logarithm_[e];
    mean += r[e] / static_cast<double>(r.size());
  }
  for (double& x : r) x -= mean;
  return r;
}

std::vector<double> vertex_means(const IntrinsicMesh& mesh, const std::vector<double>& ratios) {
  const Index last = *std::max_element(mesh.unknown.begin(), mesh.unknown.end());
  std::vector<double> sum(at(last + 1), 0.0);
  std::vector<double> count(sum.size(), 0.0);
  for (std::size_t h = 0; h < mesh.halfedge_count(); ++h) {
    const std::size_t v = at(mesh.unknown[at(mesh.origin[h])]);
    sum[v] += ratios[h / 2];
    count[v] += 1.0;
  }
  for (std::size_t v = 0; v < sum.size(); ++v) sum[v] /= count[v];
  return sum;
}

double scaling_energy(const std::vector<double>& scale, const std::vector<double>& area) {
  double whole = 0.0, larger = 0.0, smaller = 0.0;
  for (std::size_t v = 0; v < scale.size(); ++v) {
    whole += area[v];
    larger += area[v] * std::exp(2.0 * scale[v]);
    smaller += area[v] * std::exp(-2.0 * scale[v]);
  }
  return std::sqrt((larger / whole) * (smaller / whole));
}

namespace {

void set_scale(conformal::ConformalMetric& metric, std::vector<double> u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  metric.scale_range = *high - *low;
  metric.scale_factors = u;
  metric.u = std::move(u);
}

}  // namespace

void LoopedMetric::append_to(conformal::ConformalMetric& metric,
                             const ExecutionContext& context) const {
  conformal::ConformalMetric further;
  engine->finish(further, false, context);
  metric.flips.insert(metric.flips.end(), further.flips.begin(), further.flips.end());
  metric.mesh = std::move(further.mesh);
  metric.length = std::move(further.length);
  metric.bits = further.bits;
  std::vector<double> u = intrinsic::to_doubles(metric.u);
  for (std::size_t v = 0; v < u.size(); ++v) u[v] += further.scale_factors[v];
  set_scale(metric, std::move(u));
}

CarriedMetric::CarriedMetric(const conformal::ConformalMetric& metric, const PennerTargets& targets,
                             intrinsic::LoopCarrier carried, ExecutionContext& context)
    : LoopedMetric(metric, targets, std::move(carried), 53, context), reference_(metric) {
  if (started()) follow(context);
}

void CarriedMetric::follow(const ExecutionContext& context) {
  LoopedMetric::follow(context);
  intrinsic::replay_flips(engine->flips(), referred_, followed, context,
                          [&](EdgeId e) { reference_.flip(e); });
  referred_ = followed;
}

PennerRun CarriedMetric::meet(const PennerTargets& targets, Meeting how,
                              const PennerNewtonOptions& options, ExecutionContext& context) {
  const PennerRun result = how == Meeting::kConformal
                               ? run_penner(*this, targets, options, context)
                               : run_shortest(*this, targets, options, context);
  follow(context);
  return result;
}

double CarriedMetric::distance() const {
  double sum = 0.0;
  for (const double r : ratios()) sum += r * r;
  return std::isfinite(sum) ? sum : HUGE_VAL;
}

void CarriedMetric::append_to(conformal::ConformalMetric& metric,
                              const ExecutionContext& context) const {
  LoopedMetric::append_to(metric, context);
  // Where the input's edges are crossed is told by the scale that explains the lengths best.
  set_scale(metric, vertex_means(mesh(), ratios()));
}

int CarriedMetric::come_near(const PennerTargets& targets, Meeting how, const Nearing& options,
                             const std::vector<double>& area, ExecutionContext& context) {
  // A step changes no logarithm of a length by more than this, is halved so many times, and meets
  // the angles in so many.
  constexpr double kMostNearingChange = 3.0;
  const int halvings = how == Meeting::kConformal ? 6 : 3;
  const PennerNewtonOptions newton{options.tolerance, how == Meeting::kConformal ? 20 : 10};
  int steps = 0;
  for (; steps < options.most; ++steps) {
    std::vector<double> wish = ratios();
    if (scaling_energy(vertex_means(mesh(), wish), area) <= options.enough) break;
    for (double& w : wish) w = -w;
    // The shortest change that leads to the input's metric to first order, the angles kept.
    const std::vector<double> change =
        shortest_change(*this, measure(*this, targets, context), wish, context);
    if (change.empty()) break;
    const double first = std::min(1.0, kMostNearingChange / largest_of(change));
    const double before = distance();
    const auto attempt = [&](CarriedMetric& trial, double step) {
      context.check();
      if (!stretch_by(*trial.engine, change, step, context)) return false;
      trial.follow(context);
      return trial.meet(targets, how, newton, context).end == PennerEnd::kConverged &&
             trial.distance() < before;
    };
    if (!take_halved(*this, first, std::ldexp(first, -halvings), attempt)) break;
  }
  return steps;
}

}  // namespace flipfree::seamless
