#include "flipfree/conformal/newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::conformal {

namespace {

constexpr double kAlpha = 0.1;       // Armijo-like constant of Algorithm 3
constexpr double kNormStep = 1e-10;  // below this step the norm decrease is no longer asked for
constexpr double kSmallestStep = 1e-16;
// A step changes no difference of scale factors by more than this (4.6.1: "the range of the
// coefficients"): it keeps factors representable and the flips of one trial few. In double, where
// steps are followed by relaxation, by the second.
constexpr double kStepRange = 10.0, kQuickStepRange = 40.0;
// Accuracy of angles with more bits than a double has, and the error of the gradient below which
// the coarse one is not good enough.
constexpr double kCoarse = 1e-9;
constexpr double kCoarseUntil = 1e-5;
constexpr double kFine = 1e-13;
constexpr double kMuchLess = 0.5;  // a first step that lowers the norm so far needs no other test
// Vertices whose angle is off by more than `error` radians are relaxed one by one, `sweeps` times
// at most: kThorough when a line search had to cut its step below kShortStep; kQuick, in double,
// after any step that was not whole or left more than that, since a sweep costs a tenth of a Newton
// step. Chosen by measurement (docs/benchmarks.md).
struct Relaxation {
  double error;
  int sweeps;
};
constexpr double kShortStep = 0.3;
constexpr Relaxation kThorough{0.03, 8};
constexpr Relaxation kQuick{0.1, 1};
constexpr double kLessError = 0.3;  // of the error before a relaxed step: leaving less is thorough
// An error at the start beyond kFar radians goes by relaxed steps from the beginning (kRelaxed).
// Measured with single cones on g-tori (docs/benchmarks.md).
constexpr double kFar = 200.0;
// Delaunay tests in full precision, per edge and anyway, after which more lead nowhere: among
// needles thinner than scale factors can be told apart every vertex that is relaxed takes all the
// moves that it may, and Newton steps creep. They cost nearly all of the time.
constexpr std::size_t kTestsPerEdge = 2000;
constexpr std::size_t kTestsAnyway = 20'000;
// Relaxed steps need angles that are known to less than what relaxation leaves.
constexpr double kMostNoise = 0.01;
double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

double norm(const std::vector<double>& a) {
  // Scaled: gradients of 1e-200 are legitimate with many bits.
  double largest = 0.0;
  for (const double x : a) largest = std::max(largest, std::abs(x));
  if (!(largest > 0.0)) return largest;
  double sum = 0.0;
  for (const double x : a) sum += (x / largest) * (x / largest);
  return largest * std::sqrt(sum);
}

class Newton {
 public:
  Newton(MetricEngine& engine, NewtonSystem& system, const NewtonOptions& options,
         ExecutionContext& context)
      : engine_(engine), system_(system), options_(options), context_(context) {
    const std::size_t most = kTestsAnyway + kTestsPerEdge * engine.mesh().edge_count();
    most_tests_ = most - std::min(most, options.earlier_tests);
  }

  NewtonRun run;
  void iterate(Descent& descent);

 private:
  // The engine starts on the ray u + step d.
  void start_ray() {
    step_ = 0.0;
    part_.high.resize(direction_.high.size());
    part_.low.resize(direction_.low.size());
    part_.full.resize(direction_.full.size());
  }

  // Moves to `step` and evaluates there. False if the engine could not follow; it is then somewhere
  // on the ray still.
  bool move(double step, Gradient& gradient) {
    const double change = 0.5 * (step - step_);
    for (std::size_t v = 0; v < part_.high.size(); ++v) {
      const numeric::Pair moved = numeric::two_product(change, direction_.high[v]);
      part_.high[v] = moved.high;
      if (!part_.low.empty()) part_.low[v] = moved.low + change * direction_.low[v];
      if (!part_.full.empty()) part_.full[v] = direction_.full[v] * numeric::BigFloat<16>(change);
    }
    engine_.scale(part_, context_);
    step_ = step;
    ++run.evaluations;
    if (!engine_.restore_delaunay(context_)) return false;
    evaluate(gradient);
    return std::isfinite(gradient.max_error);
  }

  void evaluate(Gradient& gradient) {
    engine_.evaluate(kCoarse, gradient, context_);
    if (engine_.bits() > 53) {
      if (gradient.max_error < kCoarseUntil) engine_.evaluate(kFine, gradient, context_);
      // Close to the end sums of thousands of angles at one vertex need more than double.
      if (gradient.max_error < std::max(1e-9, 1e2 * options_.tolerance))
        engine_.evaluate(std::min(options_.tolerance, 1e-15), gradient, context_);
    }
    if (options_.pinned == nullptr || !std::isfinite(gradient.max_error)) return;
    gradient.max_error = 0.0;
    for (std::size_t v = 0; v < gradient.value.size(); ++v) {
      if ((*options_.pinned)[v] != 0) gradient.value[v] = 0.0;
      gradient.max_error = std::max(gradient.max_error, std::abs(gradient.value[v]));
    }
  }

  // Have Delaunay tests led nowhere?
  bool worn_out() const { return engine_.exact_tests() > most_tests_; }
  bool line_search(double first_step, bool ask_norm, const Gradient& start, Gradient& trial);
  bool relax(const Relaxation& how, Gradient& gradient);
  bool relaxed_step(double first_step, const Gradient& start, Gradient& trial);

  MetricEngine& engine_;
  NewtonSystem& system_;
  const NewtonOptions& options_;
  ExecutionContext& context_;
  std::size_t most_tests_ = 0;
  FineVector direction_, part_;  // part_: scratch
  double step_ = 0.0;            // along the direction
};

// Algorithm 3, LineSearch. The midpoint of the Armijo-like condition is only evaluated when the
// full step has passed the minimum along the ray: otherwise the full step is taken by the first
// test of the loop anyway. A step that halves the norm of the gradient is taken unseen: near
// needles the projected gradient is a difference of far larger numbers. On return the engine stands
// at the step taken and `trial` is the gradient there. False if no step can be told from rounding.
bool Newton::line_search(double first_step, bool ask_norm, const Gradient& start, Gradient& trial) {
  const std::vector<double>& d = direction_.high;
  const double start_norm = norm(start.value);
  double step = first_step;
  double descending = 0.0;  // largest step seen at which the energy still descends
  bool known = false;       // trial belongs to `step` already
  for (bool first = true;; first = false) {
    const bool moved = known || move(step, trial);
    known = false;
    if (moved && first && norm(trial.value) <= kMuchLess * start_norm) return true;
    const double projected = moved ? dot(d, trial.value) : std::numeric_limits<double>::infinity();
    if (projected <= 0.0) {
      if (!ask_norm || norm(trial.value) < start_norm) return true;
      if (descending == 0.0) descending = step;
    } else if (first && moved) {
      if (move(0.5 * step, trial)) {
        if (0.5 * (projected + dot(d, trial.value)) <= kAlpha * system_.slope()) {
          return move(step, trial);
        }
        known = true;
      }
    }
    step *= 0.5;
    if (descending > 0.0 && step < kNormStep * first_step) return move(descending, trial);
    if (step < kSmallestStep * first_step) return false;
  }
}

// Thesis 4.6.4 describes the stalls: where triangles are nearly degenerate, a few stiff unknowns -
// the scale of a vertex among neighbours that are far away - allow only tiny steps, and one step
// length serves all. Our cure is nonlinear elimination: those vertices solve their own equation
// alone, by a monotone search that flips only around them, after which the next Newton direction
// fits again. It leaves the minimum of the convex energy where it is. The worst come first: a
// vertex whose scale is far too small is joined to hundreds of others, and each of their flips
// would pass by it.
bool Newton::relax(const Relaxation& how, Gradient& gradient) {
  const auto stop = [&] { return worn_out(); };
  std::vector<VertexId> list;
  for (int sweep = 0; sweep < how.sweeps; ++sweep) {
    list.clear();
    for (std::size_t v = 0; v < gradient.value.size(); ++v) {
      if (std::abs(gradient.value[v]) > how.error) list.push_back(static_cast<VertexId>(v));
    }
    if (list.empty() || worn_out()) break;
    std::stable_sort(list.begin(), list.end(), [&](VertexId a, VertexId b) {
      return std::abs(gradient.value[static_cast<std::size_t>(a)]) >
             std::abs(gradient.value[static_cast<std::size_t>(b)]);
    });
    if (!engine_.relax(list, 0.1 * how.error, stop, context_)) return false;
    evaluate(gradient);
    if (!std::isfinite(gradient.max_error)) return false;
  }
  return true;
}

// Steps of Descent::kRelaxed: along the ray as far as the bound on steps allows, then relaxation,
// which repairs what one step length for all has spoiled; taken if the energy has become less.
// Where the difference drowns in rounding, the norm of the gradient decides. Otherwise half the
// step, from the same start.
bool Newton::relaxed_step(double first_step, const Gradient& start, Gradient& trial) {
  const double start_norm = norm(start.value);
  const Relaxation how{std::min(kThorough.error, kLessError * start.max_error), kThorough.sweeps};
  const Energy before = engine_.energy(context_);
  engine_.remember();
  for (double step = first_step; step > kNormStep * first_step; step *= 0.5) {
    start_ray();
    if (move(step, trial) && relax(how, trial)) {
      const Energy after = engine_.energy(context_);
      const double change = after.value - before.value;
      const double noise = before.noise + after.noise;
      const bool undecided = std::abs(change) <= noise;
      const double bound = engine_.bits() > 53 ? start_norm : kMuchLess * start_norm;
      if (change < -noise || (undecided && norm(trial.value) < bound)) return true;
      // By convexity the energy has become less if it still falls along the way done.
      if (undecided && engine_.bits() > 53 && dot(engine_.moved(), trial.value) < 0.0) return true;
      // In double, whose kinks are rounded off, creeping on would only cost time.
      if (undecided && engine_.bits() <= 53) {
        engine_.go_back();
        return false;
      }
    }
    engine_.go_back();
  }
  return false;
}

// Algorithm 3.
void Newton::iterate(Descent& descent) {
  // Where time ends in the middle of a step, the engine goes back to where that began.
  const bool limited = options_.max_seconds > 0.0;
  if (limited) engine_.remember();
  Gradient gradient, trial;
  evaluate(gradient);
  run.error_history.push_back(gradient.max_error);
  if (descent == Descent::kUnknown) {
    descent = gradient.max_error > kFar ? Descent::kRelaxed : Descent::kLineSearch;
  }
  bool hard = false;  // the norm decrease, a heuristic, is no longer asked for
  const double start_error = std::max(gradient.max_error, options_.tolerance);
  for (;;) {
    run.error = gradient.max_error;
    run.noise = gradient.noise;
    if (run.error <= options_.tolerance) {
      run.end = NewtonEnd::kConverged;
      return;
    }
    if (run.iterations >= options_.max_iterations || worn_out()) {
      run.end = NewtonEnd::kIterations;
      return;
    }
    // Most of the way is measured in digits of the error.
    const double way =
        std::log(start_error / run.error) / std::log(start_error / options_.tolerance + 1.0);
    const double fraction = std::isfinite(way) ? std::clamp(way, 0.0, 1.0) : 0.0;
    context_.report("conformal metric", fraction);
    const ProgressRange still(context_, fraction, fraction);  // factorizations report as well
    run.end = NewtonEnd::kPrecision;
    if (gradient.noise > 0.1 * run.error ||
        (options_.more_bits && descent == Descent::kRelaxed && gradient.noise > kMostNoise)) {
      run.reason = "gradient below its noise";
      return;
    }
    if (!system_.solve(engine_.mesh(), gradient, engine_.bits(), direction_, context_)) {
      run.reason = "no descent direction";
      return;
    }
    double range = 0.0;
    for (const double x : direction_.high) range = std::max(range, 2.0 * std::abs(x));
    const bool relaxed = descent == Descent::kRelaxed;
    const bool quick = engine_.bits() == 53 && !relaxed;
    const double first_step = std::min(1.0, (quick ? kQuickStepRange : kStepRange) / range);
    bool found = false;
    if (relaxed) {
      found = relaxed_step(first_step, gradient, trial);
      ++run.relaxed_iterations;
    }
    // The energy is known in double only, whatever the bits; the slope along a ray is not.
    if (!found && (!relaxed || engine_.bits() > 53)) {
      start_ray();
      found = line_search(first_step, !hard, gradient, trial);
      const bool cut = step_ < kShortStep;
      hard = hard || (found && cut);
      const Relaxation& how = cut ? kThorough : kQuick;
      if (found && (cut || (quick && (step_ < 1.0 || trial.max_error > how.error)))) {
        ++run.relaxed_iterations;
        if (!relax(how, trial)) {
          run.reason = "relaxation left the range of numbers";
          return;
        }
      }
    }
    if (!found) {
      run.reason = "no step along the direction";
      return;
    }
    if (limited) engine_.remember();
    std::swap(gradient, trial);
    ++run.iterations;
    run.error_history.push_back(gradient.max_error);
  }
}

}  // namespace

NewtonRun run_newton(MetricEngine& engine, NewtonSystem& system, const NewtonOptions& options,
                     Descent& descent, ExecutionContext& context) {
  Newton newton(engine, system, options, context);
  const bool in_time = ended_in_time([&] {
    const TimeLimit limit(context, limit_of(options.max_seconds));
    newton.iterate(descent);
  });
  if (!in_time) {
    if (!(options.max_seconds > 0.0)) throw TimeIsOver();
    engine.go_back();
    newton.run.end = NewtonEnd::kSeconds;
    newton.run.reason = "time was over during a step";
  }
  return std::move(newton.run);
}

}  // namespace flipfree::conformal
