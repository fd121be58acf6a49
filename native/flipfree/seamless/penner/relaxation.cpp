#include "flipfree/seamless/penner/relaxation.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/numeric/dense_factors.h"
#include "flipfree/seamless/bordered/loop_turns.h"
#include "flipfree/seamless/penner/penner_newton.h"

namespace flipfree::seamless {

using intrinsic::IntrinsicMesh;

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

using conformal::MetricEngine;

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
