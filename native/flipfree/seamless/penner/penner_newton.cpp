#include "flipfree/seamless/penner/penner_newton.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/conformal/newton.h"
#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::seamless {

using intrinsic::IntrinsicMesh;

using intrinsic::EdgeLabel;
namespace {

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

}  // namespace

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

bool ShortestSystem::solve(const IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
                           const PennerAngles& angles, const std::vector<double>& wish,
                           std::vector<double>& direction, ExecutionContext& context) {
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
  cholesky_.analyze(lower, context);
  if (!cholesky_.factorize(lower, context)) return false;
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
  if (loops.size() > 0) {
    numeric::SparseMatrix q = loop_derivatives(mesh, loops, angles.cotangent);
    if (mesh.symmetric()) q = numeric::SparseMatrix(symmetric.transpose() * q);
    const Eigen::MatrixXd mixed = rows * q;
    const Eigen::MatrixXd x = cholesky_.solve(mixed, context);
    const Eigen::Map<const Eigen::VectorXd> f(angles.loops.data(),
                                              static_cast<Eigen::Index>(loops.size()));
    const Eigen::MatrixXd schur = Eigen::MatrixXd(q.transpose() * q) - mixed.transpose() * x;
    const Eigen::VectorXd m =
        numeric::solve_symmetric(schur, f - q.transpose() * w - x.transpose() * right);
    d += q * m;
    const Eigen::VectorXd rest = right - mixed * m;
    d += cut * cholesky_.solve(rest, context);
  } else {
    d += cut * cholesky_.solve(right, context);
  }
  if (mesh.symmetric()) d = symmetric * d.eval();
  direction.assign(d.data(), d.data() + d.size());
  return d.allFinite();
}

namespace {

// log(exp(a) + exp(b)).
double log_sum(double a, double b) {
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

}  // namespace

ReferenceMetric::ReferenceMetric(const intrinsic::FlippedMetric& metric) {
  std::vector<double> length = intrinsic::to_doubles(metric.initial_length);
  IntrinsicMesh mesh = metric.initial;
  intrinsic::FlipLengths<double> lengths(length);
  for (std::size_t i = 0; i < metric.euclidean_flips; ++i) {
    // The first plain flip of a symmetric one is that of the edge which gave it its type.
    const auto stencil =
        intrinsic::flip_stencil(mesh, metric.flips[i].plain.edges[0], metric.flips[i].type);
    lengths.euclidean(stencil);
    intrinsic::flip_symmetrically(mesh, stencil);
  }
  mesh_ = {std::move(mesh.next), std::move(mesh.origin)};
  logarithm_.reserve(length.size());
  for (const double l : length) logarithm_.push_back(std::log(l));
  for (std::size_t i = metric.euclidean_flips; i < metric.flips.size(); ++i) {
    const intrinsic::PlainFlips& plain = metric.flips[i].plain;
    for (int k = 0; k < plain.count; ++k) flip(plain.edges[at(k)]);
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

constexpr double kMostNewtonChange = 1.0;  // of a logarithm of a length in one step
constexpr double kLeastShareOfStep = 1e-3;

double largest_of(const std::vector<double>& values) {
  double largest = 1e-300;
  for (const double x : values) largest = std::max(largest, std::abs(x));
  return largest;
}

// Changes the logarithms of all lengths by `step` times these.
bool stretch_by(MetricEngine& engine, const std::vector<double>& direction, double step,
                ExecutionContext& context) {
  std::vector<double> part = direction;
  for (double& d : part) d *= step;
  engine.stretch(part, context);
  return engine.restore_delaunay(context);
}

}  // namespace

PennerRun run_shortest(std::unique_ptr<conformal::MetricEngine>& engine,
                       intrinsic::LoopCarrier& loops, const PennerTargets& targets,
                       const PennerNewtonOptions& options, ExecutionContext& context) {
  require_same_mesh(*engine, loops);
  PennerRun run;
  ShortestSystem system;
  PennerAngles angles;
  const std::vector<double> no_wish(engine->mesh().edge_count(), 0.0);
  std::vector<double> direction;
  measure(*engine, loops, targets, angles, context);
  run.error_history.push_back(angles.max_error);
  run.end = PennerEnd::kIterations;
  while (angles.max_error > options.tolerance && run.iterations < options.max_iterations) {
    context.check();
    run.end = PennerEnd::kStalled;
    if (!system.solve(engine->mesh(), loops, angles, no_wish, direction, context)) break;
    const double first = std::min(1.0, kMostNewtonChange / largest_of(direction));
    const auto move = [&](double step) { return stretch_by(*engine, direction, step, context); };
    if (!descend(*engine, loops, targets, first, kLeastShareOfStep * first, move, angles, context))
      break;
    ++run.iterations;
    run.error_history.push_back(angles.max_error);
    run.end = PennerEnd::kIterations;
  }
  if (angles.max_error <= options.tolerance) run.end = PennerEnd::kConverged;
  run.error = angles.max_error;
  return run;
}

conformal::EngineInput start_of(const conformal::ConformalMetric& metric,
                                const std::vector<double>& target) {
  conformal::EngineInput input;
  input.setup = {metric.mesh, metric.input_halfedge, metric.on_boundary};
  input.vertex_count = static_cast<Index>(target.size());
  input.edge_length = intrinsic::to_doubles(metric.length);
  input.target = target;
  return input;
}

namespace {

void set_scale(conformal::ConformalMetric& metric, std::vector<double> u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  metric.scale_range = *high - *low;
  metric.scale_factors = u;
  metric.u = std::move(u);
}

}  // namespace

void append(const MetricEngine& engine, conformal::ConformalMetric& metric,
            const ExecutionContext& context) {
  conformal::ConformalMetric further;
  engine.finish(further, false, context);
  metric.flips.insert(metric.flips.end(), further.flips.begin(), further.flips.end());
  metric.mesh = std::move(further.mesh);
  metric.length = std::move(further.length);
  metric.bits = further.bits;
  std::vector<double> u = intrinsic::to_doubles(metric.u);
  for (std::size_t v = 0; v < u.size(); ++v) u[v] += further.scale_factors[v];
  set_scale(metric, std::move(u));
}

CarriedMetric::CarriedMetric(const conformal::ConformalMetric& metric, const PennerTargets& targets,
                             intrinsic::LoopCarrier loops, ExecutionContext& context)
    : input_(
          std::make_shared<const conformal::EngineInput>(start_of(metric, targets.vertex_angle))),
      engine_(make_engine(*input_, 53, context)),
      loops_(std::move(loops)),
      reference_(metric) {
  if (!started()) return;
  intrinsic::replay_flips(engine_->flips(), 0, engine_->flips().size(), context,
                          [&](EdgeId e) { loops_.flip(e); });
  follow(context);
}

void CarriedMetric::follow(ExecutionContext& context) {
  intrinsic::replay_flips(engine_->flips(), followed_, engine_->flips().size(), context,
                          [&](EdgeId e) { reference_.flip(e); });
  followed_ = engine_->flips().size();
}

PennerRun CarriedMetric::meet(const PennerTargets& targets, Meeting how,
                              const PennerNewtonOptions& options, ExecutionContext& context) {
  const PennerRun result = how == Meeting::kConformal
                               ? run_penner(engine_.own, loops_, targets, options, context)
                               : run_shortest(engine_.own, loops_, targets, options, context);
  follow(context);
  return result;
}

PennerAngles CarriedMetric::angles(const PennerTargets& targets, ExecutionContext& context) const {
  PennerAngles angles;
  measure(*engine_.own, loops_, targets, angles, context);
  return angles;
}

std::vector<double> CarriedMetric::way_back(const PennerTargets& targets, ShortestSystem& system,
                                            ExecutionContext& context) const {
  std::vector<double> wish = reference_.ratios(engine_->lengths()), direction;
  for (double& w : wish) w = -w;
  if (!system.solve(engine_->mesh(), loops_, angles(targets, context), wish, direction, context))
    direction.clear();
  return direction;
}

bool CarriedMetric::stretch(const std::vector<double>& direction, double step,
                            ExecutionContext& context) {
  const std::size_t first = engine_->flips().size();
  if (!stretch_by(*engine_.own, direction, step, context)) return false;
  intrinsic::replay_flips(engine_->flips(), first, engine_->flips().size(), context,
                          [&](EdgeId e) { loops_.flip(e); });
  return true;
}

std::vector<double> CarriedMetric::scale() const {
  return vertex_means(engine_->mesh(), reference_.ratios(engine_->lengths()));
}

double CarriedMetric::distance() const {
  double sum = 0.0;
  for (const double r : reference_.ratios(engine_->lengths())) sum += r * r;
  return std::isfinite(sum) ? sum : HUGE_VAL;
}

void CarriedMetric::append_to(conformal::ConformalMetric& metric,
                              const ExecutionContext& context) const {
  append(*engine_.own, metric, context);
  set_scale(metric, scale());
}

namespace {

// A step towards the input's metric changes no logarithm of a length by more than this, is halved
// so many times, and meets the angles in so many.
constexpr double kMostNearingChange = 3.0;
struct NearingWay {
  int halvings, newton_steps;
};
constexpr NearingWay kConformalWay{6, 20}, kShortestWay{3, 10};

}  // namespace

int come_near(CarriedMetric& metric, const PennerTargets& targets, Meeting how,
              const Nearing& options, const std::vector<double>& area, ExecutionContext& context) {
  const NearingWay& way = how == Meeting::kConformal ? kConformalWay : kShortestWay;
  PennerNewtonOptions newton;
  newton.tolerance = options.tolerance;
  newton.max_iterations = way.newton_steps;
  double distance = metric.distance();
  ShortestSystem system;
  int steps = 0;
  for (; steps < options.most && !(scaling_energy(metric.scale(), area) <= options.enough);
       ++steps) {
    const std::vector<double> direction = metric.way_back(targets, system, context);
    if (direction.empty()) break;
    double step = std::min(1.0, kMostNearingChange / largest_of(direction));
    const double before = distance;
    for (int halving = 0; distance == before && halving < way.halvings; ++halving, step *= 0.5) {
      context.check();
      CarriedMetric trial = metric.copy();
      if (!trial.stretch(direction, step, context) ||
          trial.meet(targets, how, newton, context).end != PennerEnd::kConverged ||
          !(trial.distance() < before))
        continue;
      distance = trial.distance();
      metric = std::move(trial);
    }
    if (distance == before) break;
  }
  return steps;
}

}  // namespace flipfree::seamless
