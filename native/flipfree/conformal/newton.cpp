#include "flipfree/conformal/newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace flipfree::conformal {
namespace {

constexpr double kAlpha = 0.1;       // Armijo-like constant of Algorithm 3
constexpr double kNormStep = 1e-10;  // below this step the norm decrease is no longer asked for
constexpr double kSmallestStep = 1e-16;
constexpr double kMuchLess = 0.5;  // a first step that lowers the norm so far needs no other test
// When a line search had to cut its step below kShortStep, vertices whose angle is off by more than
// kRelaxError radians are relaxed one by one, kRelaxSweeps times at most. Chosen by measurement
// (docs/conformal.md).
constexpr double kShortStep = 0.3;
constexpr double kRelaxError = 0.03;
constexpr int kRelaxSweeps = 4;
// An error at the start beyond kFar radians is approached on a path of targets (TargetPath). A
// problem on the way counts as solved below kLoose radians; strides grow while full steps are taken
// and shrink where they are not. A problem that is not solved in kTries steps is given up: back to
// the one before, and on with a shorter stride. On the way every step is followed by relaxation.
// Measured with single cones on g-tori (docs/conformal.md).
constexpr double kFar = 200.0;
constexpr double kLoose = 3.0;
constexpr double kFirstStride = 0.01;
constexpr double kStrideGrowth = 1.6;
constexpr double kStrideShrink = 0.5;
constexpr double kTurnBack = 0.3;
constexpr double kSmallestStride = 1e-12;
constexpr int kTries = 3;
constexpr double kPathShare = 0.8;  // of the progress

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

class Deadline {
 public:
  explicit Deadline(double seconds) : seconds_(seconds) {}
  bool over() const { return seconds_ > 0.0 && watch_.seconds() > seconds_; }

 private:
  Stopwatch watch_;
  double seconds_;
};

// The engine on the ray u + step d.
class Ray {
 public:
  Ray(MetricEngine& engine, const FineVector& direction, double accuracy, double tolerance,
      NewtonRun& run)
      : engine_(engine),
        direction_(direction),
        accuracy_(accuracy),
        tolerance_(tolerance),
        run_(run) {
    part_.high.resize(direction.high.size());
    part_.low.resize(direction.low.size());
  }

  // Moves to `step` and evaluates there. False if the engine could not follow; it is then somewhere
  // on the ray still.
  bool move(double step, Gradient& gradient, ExecutionContext& context) {
    const Stopwatch watch;
    const double change = 0.5 * (step - step_);
    for (std::size_t v = 0; v < part_.high.size(); ++v) {
      part_.high[v] = change * direction_.high[v];
      if (!part_.low.empty()) {
        part_.low[v] =
            std::fma(change, direction_.high[v], -part_.high[v]) + change * direction_.low[v];
      }
    }
    engine_.scale(part_, context);
    step_ = step;
    ++run_.evaluations;
    const bool followed = engine_.restore_delaunay(context);
    run_.seconds_flips += watch.seconds();
    if (!followed) return false;
    evaluate(gradient, context);
    return std::isfinite(gradient.max_error);
  }

  void evaluate(Gradient& gradient, ExecutionContext& context) {
    const Stopwatch watch;
    engine_.evaluate(accuracy_, gradient, context);
    // Close to the end sums of thousands of angles at one vertex need more than double.
    if (engine_.bits() > 53 && gradient.max_error < std::max(1e-9, 1e2 * tolerance_)) {
      engine_.evaluate(std::min(tolerance_, 1e-15), gradient, context);
    }
    run_.seconds_angles += watch.seconds();
  }

  double step() const { return step_; }

 private:
  MetricEngine& engine_;
  const FineVector& direction_;
  double accuracy_;
  double tolerance_;
  double step_ = 0.0;
  NewtonRun& run_;
  FineVector part_;
};

// Algorithm 3, LineSearch. The midpoint of the Armijo-like condition is only evaluated when the
// full step has passed the minimum along the ray: otherwise the full step is taken by the first
// test of the loop anyway. A step that halves the norm of the gradient is taken unseen: near
// needles the projected gradient is a difference of far larger numbers. On return the engine stands
// at the step taken and `trial` is the gradient there. False if no step can be told from rounding.
bool line_search(Ray& ray, double first_step, bool ask_norm, const std::vector<double>& d,
                 double slope, const Gradient& start, Gradient& trial, const Deadline& deadline,
                 ExecutionContext& context) {
  const double start_norm = norm(start.value);
  double step = first_step;
  double descending = 0.0;  // largest step seen at which the energy still descends
  bool known = false;       // trial belongs to `step` already
  for (bool first = true;; first = false) {
    const bool moved = known || ray.move(step, trial, context);
    known = false;
    if (moved && first && norm(trial.value) <= kMuchLess * start_norm) return true;
    const double projected = moved ? dot(d, trial.value) : std::numeric_limits<double>::infinity();
    if (projected <= 0.0) {
      if (!ask_norm || norm(trial.value) < start_norm) return true;
      if (descending == 0.0) descending = step;
    } else if (first && moved) {
      if (ray.move(0.5 * step, trial, context)) {
        if (0.5 * (projected + dot(d, trial.value)) <= kAlpha * slope) {
          return ray.move(step, trial, context);
        }
        known = true;
      }
    }
    step *= 0.5;
    if (deadline.over()) return false;
    if (descending > 0.0 && step < kNormStep * first_step)
      return ray.move(descending, trial, context);
    if (step < kSmallestStep * first_step) return false;
  }
}

// Thesis 4.6.4 describes the stalls: where triangles are nearly degenerate, a few stiff unknowns -
// the scale of a vertex among neighbours that are far away - allow only tiny steps, and one step
// length serves all. Our cure is nonlinear elimination: those vertices solve their own equation
// alone, by a monotone search that flips only around them, after which the next Newton direction
// fits again. It leaves the minimum of the convex energy where it is.
bool relax(MetricEngine& engine, Ray& ray, Gradient& gradient, const Deadline& deadline,
           ExecutionContext& context) {
  std::vector<VertexId> list;
  for (int sweep = 0; sweep < kRelaxSweeps; ++sweep) {
    list.clear();
    for (std::size_t v = 0; v < gradient.value.size(); ++v) {
      if (std::abs(gradient.value[v]) > kRelaxError) list.push_back(static_cast<VertexId>(v));
    }
    if (list.empty() || deadline.over()) break;
    // The worst last: its neighbours' moves would spoil it again.
    std::stable_sort(list.begin(), list.end(), [&](VertexId a, VertexId b) {
      return std::abs(gradient.value[static_cast<std::size_t>(a)]) <
             std::abs(gradient.value[static_cast<std::size_t>(b)]);
    });
    const auto stop = [&] { return deadline.over(); };
    if (!engine.relax(list, 0.1 * kRelaxError, stop, context)) return false;
    ray.evaluate(gradient, context);
    if (!std::isfinite(gradient.max_error)) return false;
  }
  return true;
}

// Puts the engine on the problem at `share` of the path.
void aim(MetricEngine& engine, TargetPath& path, double share) {
  path.reached = std::min(1.0, share);
  if (path.reached == 1.0) {
    engine.set_target(path.final);
    return;
  }
  std::vector<double> target(path.final.size());
  for (std::size_t v = 0; v < target.size(); ++v)
    target[v] = path.final[v] - (1.0 - path.reached) * path.difference[v];
  engine.set_target(target);
}

// Algorithm 3. `lost` receives where to go on if the engine lost its way.
NewtonRun iterate(MetricEngine& engine, NewtonSystem& system, const NewtonOptions& options,
                  TargetPath& path, std::optional<ScaleLogarithms>& lost,
                  ExecutionContext& context) {
  const Deadline deadline(options.max_seconds);
  NewtonRun run;
  Gradient gradient;
  Gradient trial;
  const std::size_t unknowns = path.final.size();
  FineVector direction{std::vector<double>(unknowns, 0.0), {}};
  const double accuracy = 1e-13;
  Ray here(engine, direction, accuracy, options.tolerance, run);
  if (path.known) aim(engine, path, path.reached);
  here.evaluate(gradient, context);
  if (!path.known) {
    path.known = true;
    if (gradient.max_error > kFar && std::isfinite(gradient.max_error)) {
      path.difference = gradient.value;
      path.stride = kFirstStride;
      aim(engine, path, 0.0);
      here.evaluate(gradient, context);
    }
  }
  run.error_history.push_back(gradient.max_error);
  bool on_path = path.reached < 1.0;
  double solved = path.reached;  // the share of the path to which the engine can go back
  int tried = 0;
  if (on_path) engine.remember();
  bool hard = false;  // the norm decrease, a heuristic, is no longer asked for
  const double start_error =
      std::max(path.difference.empty() ? gradient.max_error : kLoose, options.tolerance);
  for (;;) {
    if (on_path) {
      if (gradient.max_error < kLoose) {
        on_path = path.reached < 1.0;
        if (on_path) {
          engine.remember();
          solved = path.reached;
          tried = 0;
          aim(engine, path, path.reached + path.stride);
          here.evaluate(gradient, context);
        }
      } else if (++tried > kTries && path.stride > kSmallestStride) {
        engine.go_back();
        path.stride = kTurnBack * (path.reached - solved);
        aim(engine, path, solved + path.stride);
        here.evaluate(gradient, context);
        tried = 0;
      }
    }
    run.error = gradient.max_error;
    run.noise = gradient.noise;
    if (run.error <= options.tolerance && path.reached == 1.0) {
      run.end = NewtonEnd::kConverged;
      return run;
    }
    if (run.iterations >= options.max_iterations) {
      run.end = NewtonEnd::kIterations;
      return run;
    }
    if (deadline.over()) {
      run.end = NewtonEnd::kSeconds;
      return run;
    }
    // Most of the way is measured in digits of the error, of a path in its length.
    const double digits = std::clamp(
        std::log(start_error / run.error) / std::log(start_error / options.tolerance + 1.0), 0.0,
        1.0);
    const double fraction = path.difference.empty() ? digits
                            : path.reached < 1.0    ? kPathShare * path.reached
                                                    : kPathShare + (1.0 - kPathShare) * digits;
    context.report("conformal metric", fraction);
    const ProgressRange still(context, fraction, fraction);  // factorizations report as well
    run.end = NewtonEnd::kPrecision;
    if (gradient.noise > 0.1 * run.error) {
      run.reason = "gradient below its noise";
      return run;
    }
    if (!system.solve(engine.mesh(), gradient, direction, context)) {
      run.reason = "no descent direction";
      return run;
    }
    double range = 0.0;
    for (const double x : direction.high) range = std::max(range, 2.0 * std::abs(x));
    const double first_step = range > options.max_step_range ? options.max_step_range / range : 1.0;
    Ray ray(engine, direction, accuracy, options.tolerance, run);
    const bool found = line_search(ray, first_step, !hard, direction.high, system.slope(), gradient,
                                   trial, deadline, context);
    if (!found) {
      if (deadline.over()) run.end = NewtonEnd::kSeconds;
      run.reason = "no step along the direction";
      return run;
    }
    std::swap(gradient, trial);
    ++run.iterations;
    path.stride *= ray.step() >= 1.0 ? kStrideGrowth : ray.step() < 0.5 ? kStrideShrink : 1.0;
    if (path.reached < 1.0 || ray.step() < kShortStep) {
      hard = true;
      ++run.relaxed_iterations;
      ScaleLogarithms before = engine.scaled_so_far();
      const Stopwatch relaxing;
      const bool relaxed = relax(engine, ray, gradient, deadline, context);
      run.seconds_relax += relaxing.seconds();
      if (!relaxed) {
        lost = std::move(before);
        run.reason = "relaxation left the range of numbers";
        return run;
      }
    }
    run.error_history.push_back(gradient.max_error);
  }
}

}  // namespace

NewtonRun run_newton(MetricEngine& engine, NewtonSystem& system, const NewtonOptions& options,
                     TargetPath& path, ScaleLogarithms& scale, ExecutionContext& context) {
  std::optional<ScaleLogarithms> lost;
  const NewtonRun run = iterate(engine, system, options, path, lost, context);
  scale = lost ? std::move(*lost) : engine.scaled_so_far();
  return run;
}

}  // namespace flipfree::conformal
