#include "flipfree/seamless/penner/penner_newton.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/conformal/metric/newton.h"

namespace flipfree::seamless {

using conformal::FineVector;
using conformal::MetricEngine;
using intrinsic::FlipRecord;

namespace {

constexpr double kSmallestRestoredStep = 1e-4;
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
// Errors below this, in radians, are not reduced further for lack of bits.
constexpr double kRounding = 1e-7;

// A flip costs as much as it has crossings with the loops, which grow with every flip.
void carry_further(const MetricEngine& engine, std::size_t from, intrinsic::LoopCarrier& loops,
                   const ExecutionContext& context) {
  const std::vector<FlipRecord>& flips = engine.flips();
  for (std::size_t i = from; i < flips.size(); ++i) {
    context.check();
    for (int k = 0; k < flips[i].plain.count; ++k)
      loops.flip(flips[i].plain.edges[static_cast<std::size_t>(k)]);
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
               std::unique_ptr<PennerSystem> system, bool prepared, ExecutionContext& context)
      : engine_(engine),
        loops_(loops),
        targets_(targets),
        options_(options),
        context_(context),
        system_(std::move(system)),
        prepared_(prepared) {}

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
      run_.end = PennerEnd::kPrecision;
      if (!solve()) break;
      if (angles_.max_error > kRounding) run_.end = PennerEnd::kStalled;
      if (no_progress() || !(restoring_ ? restored_step() : plain_step())) break;
      ++run_.iterations;
      run_.error_history.push_back(angles_.max_error);
      run_.end = PennerEnd::kConverged;
    }
    if (angles_.max_error <= options_.tolerance) run_.end = PennerEnd::kConverged;
    run_.error = angles_.max_error;
    return std::move(run_);
  }

 private:
  bool solve() {
    if (std::exchange(prepared_, false))
      return system_->solve_prepared(engine_->mesh(), angles_, direction_, context_);
    return system_->solve(engine_->mesh(), loops_, angles_, direction_, context_);
  }

  bool no_progress() const {
    const std::size_t now = run_.error_history.size();
    return run_.restored > static_cast<int>(kPatience) &&
           run_.error_history[now - 1] > 0.5 * run_.error_history[now - 1 - kPatience];
  }

  double first_step() const {
    return std::min({1.0, options_.max_stretch / std::max(direction_.most_stretch, 1e-300),
                     options_.max_scale_range / std::max(direction_.scale_range, 1e-300)});
  }

  // Changes the engine by `step` times the direction. False if it could not follow.
  bool move(MetricEngine& engine, double step) {
    ++run_.evaluations;
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

  // Halves the step until the norm of all errors falls.
  bool plain_step() {
    const double first = first_step();
    const intrinsic::LoopCarrier saved = loops_;
    const std::size_t flips = engine_->flips().size();
    engine_->remember();
    for (double step = first;; step *= 0.5) {
      if (step <= kShortStep * first && angles_.max_error > options_.tolerance) {
        restoring_ = true;
        return restore_here() && (angles_.max_error <= options_.tolerance || restored_step());
      }
      if (step < kShortStep * first) return false;
      if (move(*engine_, step)) {
        carry_further(*engine_, flips, loops_, context_);
        measure(*engine_, loops_, targets_, trial_, context_);
        if (trial_.norm < (1.0 - kArmijo * step) * angles_.norm) break;
      }
      engine_->go_back();
      loops_ = saved;
    }
    std::swap(angles_, trial_);
    return true;
  }

  // Meets the cones by conformal changes alone.
  bool meet_cones(MetricEngine& engine, double loop_error) {
    conformal::NewtonOptions newton;
    newton.tolerance = std::max(0.1 * options_.tolerance, kCones * loop_error);
    newton.max_iterations = kConeIterations;
    newton.more_bits = engine.bits() == 53;
    conformal::Descent descent = conformal::Descent::kLineSearch;
    return run_newton(engine, system_->laplacian(), newton, descent, context_).end ==
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
  std::unique_ptr<PennerSystem> system_;  // moving one would copy its matrices
  bool prepared_;                         // is the system, for the next direction
  PennerAngles angles_, trial_;
  PennerDirection direction_;
  bool restoring_ = false;
  PennerRun run_;
};

}  // namespace

PennerRun run_penner(std::unique_ptr<MetricEngine>& engine, intrinsic::LoopCarrier& loops,
                     const PennerTargets& targets, const PennerNewtonOptions& options,
                     ExecutionContext& context) {
  require_same_mesh(*engine, loops);
  return PennerNewton(engine, loops, targets, options, std::make_unique<PennerSystem>(), false,
                      context)
      .run();
}

PennerRun run_prepared_penner(std::unique_ptr<MetricEngine>& engine, intrinsic::LoopCarrier& loops,
                              const PennerTargets& targets, const PennerNewtonOptions& options,
                              std::unique_ptr<PennerSystem> prepared, ExecutionContext& context) {
  require_same_mesh(*engine, loops);
  return PennerNewton(engine, loops, targets, options, std::move(prepared), true, context).run();
}

}  // namespace flipfree::seamless
