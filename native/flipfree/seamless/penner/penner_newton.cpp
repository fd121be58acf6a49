#include "flipfree/seamless/penner/penner_newton.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/conformal/newton.h"
#include "flipfree/seamless/bordered/loop_turns.h"

namespace flipfree::seamless {

using intrinsic::IntrinsicMesh;

namespace {

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

}  // namespace

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

void require_same_mesh(const conformal::MetricEngine& engine, const intrinsic::LoopCarrier& loops) {
  debug_require("loops and metric", "they have one triangulation",
                [&] { return loops.mesh().next == engine.mesh().next; });
}

void measure(const conformal::MetricEngine& engine, const intrinsic::LoopCarrier& loops,
             const PennerTargets& targets, PennerAngles& out, ExecutionContext& context) {
  const IntrinsicMesh& mesh = engine.mesh();
  std::vector<double> tangent;
  engine.half_tangents(tangent, context);
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
    loops.visit_corners(i, [&](const intrinsic::PassedCorner& corner) {
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
}

bool PennerSystem::prepare(const IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
                           const PennerAngles& angles, ExecutionContext& context) {
  if (!std::isfinite(angles.max_error)) return false;
  if (!laplacian_.factorize(mesh, angles.vertices, context)) return false;
  if (loops.size() == 0) return true;
  const auto vertex_count = static_cast<Eigen::Index>(angles.vertices.value.size());
  const numeric::SparseMatrix r = loop_derivatives(mesh, loops, angles.cotangent);
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

bool PennerSystem::solve(const IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
                         const PennerAngles& angles, PennerDirection& direction,
                         ExecutionContext& context) {
  if (!prepare(mesh, loops, angles, context)) return false;
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

Eigen::MatrixXd PennerSystem::norm_of_turns() const {
  return Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower>(gram_).solve(
      Eigen::MatrixXd::Identity(gram_.rows(), gram_.cols()));
}

using conformal::FineVector;
using conformal::MetricEngine;
using intrinsic::FlipRecord;

namespace {

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
// A flip costs as much as it has crossings with the loops, which grow with every flip.
void carry_further(const MetricEngine& engine, std::size_t from, intrinsic::LoopCarrier& loops,
                   const ExecutionContext& context) {
  const std::vector<FlipRecord>& flips = engine.flips();
  for (std::size_t i = from; i < flips.size(); ++i) {
    context.check();
    for (int k = 0; k < flips[i].plain.count; ++k) loops.flip(flips[i].plain.edges[at(k)]);
  }
}

double norm_of(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double x : values) squares += x * x;
  return std::sqrt(squares);
}

class PennerNewton {
 public:
  PennerNewton(std::unique_ptr<MetricEngine>& engine, intrinsic::LoopCarrier& loops,
               const PennerTargets& targets, const PennerNewtonOptions& options,
               ExecutionContext& context)
      : engine_(engine), loops_(loops), targets_(targets), options_(options), context_(context) {}

  PennerRun run() {
    measure(*engine_, loops_, targets_, angles_, context_);
    run_.error_history.push_back(angles_.max_error);
    double before = std::numeric_limits<double>::infinity();
    run_.end = PennerEnd::kConverged;
    while (angles_.max_error > options_.tolerance || angles_.max_error < kWorthwhileGain * before) {
      if (angles_.max_error == 0.0) break;
      run_.end = PennerEnd::kIterations;
      if (run_.iterations >= options_.max_iterations) break;
      context_.check();
      before = angles_.max_error;
      run_.end = PennerEnd::kStalled;
      if (!solve() || no_progress() || !(restoring_ ? restored_step() : plain_step())) break;
      ++run_.iterations;
      run_.error_history.push_back(angles_.max_error);
      run_.end = PennerEnd::kConverged;
    }
    if (angles_.max_error <= options_.tolerance) run_.end = PennerEnd::kConverged;
    run_.error = angles_.max_error;
    return std::move(run_);
  }

 private:
  bool solve() { return system_.solve(engine_->mesh(), loops_, angles_, direction_, context_); }

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
    std::vector<double> stretch;
    stretch.reserve(direction_.stretch.size());
    for (const double s : direction_.stretch) stretch.push_back(step * s);
    engine.stretch(stretch, context_);
    return engine.restore_delaunay(context_);
  }

  bool plain_step() {
    const double first = first_step();
    const auto move_by = [&](double step) { return move(*engine_, step); };
    if (descend(*engine_, loops_, targets_, first, kShortStep * first, move_by, angles_, context_))
      return true;
    if (angles_.max_error <= options_.tolerance) return false;
    restoring_ = true;
    return restore_here() && (angles_.max_error <= options_.tolerance || restored_step());
  }

  // Meets the cones by conformal changes alone.
  bool meet_cones(MetricEngine& engine, double loop_error) {
    conformal::NewtonOptions newton;
    newton.tolerance = std::max(0.1 * options_.tolerance, kCones * loop_error);
    newton.max_iterations = kConeIterations;
    newton.more_bits = engine.bits() == 53;
    conformal::Descent descent = conformal::Descent::kLineSearch;
    return run_newton(engine, system_.laplacian(), newton, descent, context_).end ==
           conformal::NewtonEnd::kConverged;
  }

  bool restore_here() {
    if (norm_of(angles_.vertices.value) <= kCones * norm_of(angles_.loops)) return true;
    std::unique_ptr<MetricEngine> trial = engine_->copy();
    if (!meet_cones(*trial, norm_of(angles_.loops))) return false;
    carry_further(*trial, engine_->flips().size(), loops_, context_);
    engine_ = std::move(trial);
    measure(*engine_, loops_, targets_, angles_, context_);
    return solve();
  }

  // Halves the step until the loops' error falls where the cones are met again.
  bool restored_step() {
    const double first = first_step();
    const double before = norm_of(angles_.loops);
    for (double step = first; step >= kSmallestRestoredStep * first; step *= 0.5) {
      std::unique_ptr<MetricEngine> trial = engine_->copy();
      if (!move(*trial, step) || !meet_cones(*trial, before)) continue;
      intrinsic::LoopCarrier carried = loops_;
      carry_further(*trial, engine_->flips().size(), carried, context_);
      measure(*trial, carried, targets_, trial_, context_);
      if (!(norm_of(trial_.loops) < (1.0 - kArmijo * step) * before)) continue;
      engine_ = std::move(trial);
      loops_ = std::move(carried);
      std::swap(angles_, trial_);
      ++run_.restored;
      restoring_ = step < 1.0;
      return true;
    }
    return false;
  }

  std::unique_ptr<MetricEngine>& engine_;
  intrinsic::LoopCarrier& loops_;
  const PennerTargets& targets_;
  const PennerNewtonOptions& options_;
  ExecutionContext& context_;
  PennerSystem system_;
  PennerAngles angles_, trial_;
  PennerDirection direction_;
  bool restoring_ = false;
  PennerRun run_;
};

}  // namespace

bool descend(MetricEngine& engine, intrinsic::LoopCarrier& loops, const PennerTargets& targets,
             double first, double least, const std::function<bool(double step)>& move,
             PennerAngles& angles, ExecutionContext& context) {
  const intrinsic::LoopCarrier saved = loops;
  const std::size_t flips = engine.flips().size();
  PennerAngles trial;
  engine.remember();
  for (double step = first; step > least; step *= 0.5) {
    if (move(step)) {
      carry_further(engine, flips, loops, context);
      measure(engine, loops, targets, trial, context);
      if (trial.norm < (1.0 - kArmijo * step) * angles.norm) {
        std::swap(angles, trial);
        return true;
      }
    }
    engine.go_back();
    loops = saved;
  }
  return false;
}

PennerRun run_penner(std::unique_ptr<MetricEngine>& engine, intrinsic::LoopCarrier& loops,
                     const PennerTargets& targets, const PennerNewtonOptions& options,
                     ExecutionContext& context) {
  require_same_mesh(*engine, loops);
  return PennerNewton(engine, loops, targets, options, context).run();
}

}  // namespace flipfree::seamless
