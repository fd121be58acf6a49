#include "flipfree/distortion/minimize.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy.h"
#include "flipfree/distortion/newton_system.h"
#include "flipfree/distortion/rest_shapes.h"
#include "flipfree/distortion/working_rest.h"

namespace flipfree {
namespace {

using namespace distortion;  // private helpers of this stage

// The step goes this far towards the first flip; closer would leave a triangle whose barrier
// dominates the next step.
constexpr double kShareOfFlip = 0.9;
constexpr double kSufficientDecrease = 1e-4;
constexpr double kShortestStep = 1e-12;
// Below this relative size a difference of two energies is rounding (sums of 1e6 terms); slopes
// decide instead.
constexpr double kEnergyRounding = 1e-11;

void check_input(const Surface& chart, const Points2& uv, const MinimizeOptions& options,
                 const ExecutionContext& context) {
  if (chart.faces.rows() == 0) throw_invalid(ErrorCode::kEmptyMesh, "The chart has no faces.");
  if (uv.rows() != chart.vertices.rows()) {
    throw_invalid(ErrorCode::kBadShape, "The initial map has " + std::to_string(uv.rows()) +
                                            " points for " + std::to_string(chart.vertices.rows()) +
                                            " vertices.");
  }
  for (const VertexId v : options.fixed) {
    if (v < 0 || v >= uv.rows()) {
      throw_invalid(ErrorCode::kBadPins, "Fixed vertex " + std::to_string(v) + " does not exist.",
                    ElementKind::kVertex, {v});
    }
  }
  auto flipped = flipped_faces(chart.faces, uv, context);
  if (!flipped.empty()) {
    const std::string count = std::to_string(flipped.size());
    const std::string first = std::to_string(flipped.front());
    if (flipped.size() > 1000) flipped.resize(1000);
    throw_invalid(ErrorCode::kBadOption,
                  "The initial map has " + count +
                      " flipped or collapsed triangles, the first is face " + first +
                      ". Unwrap it instead of improving it.",
                  ElementKind::kFace, std::move(flipped));
  }
}

// One run of the method; the state that its steps share.
class Minimizer {
 public:
  Minimizer(const Surface& chart, const Points2& initial, const MinimizeOptions& options,
            ExecutionContext& context)
      : faces_(chart.faces),
        options_(options),
        context_(context),
        uv_(initial),
        fixed_(static_cast<std::size_t>(initial.rows()), 0),
        rest_(build_rest_shapes(chart, context)) {
    for (const VertexId v : options.fixed) fixed_[static_cast<std::size_t>(v)] = 1;
    if (options.fixed.empty()) normalise();
  }

  Points2 run(Stats& stats);

 private:
  enum class Step { kTaken, kConverged, kStalled };

  void normalise();
  void finish_unit();
  Step iterate(NewtonSystem& system, bool progressive);
  // Longest acceptable step along direction_, 0 if there is none; leaves the new map in trial_.
  double line_search(double slope, double energy, bool progressive);
  void move(double step) { trial_ = uv_ + step * direction_; }

  const Triangles& faces_;
  const MinimizeOptions& options_;
  ExecutionContext& context_;
  Points2 uv_;
  Points2 trial_;
  Points2 direction_;
  std::vector<char> fixed_;
  RestShapes rest_;
  std::vector<RestTriangle> working_;
  EnergySums sums_;  // of uv_ against the true rest shapes
};

// Without fixed vertices: bounding box centred at the origin, where doubles are densest, and about
// as large as the rest shapes. Kept only if the exact test still holds.
void Minimizer::normalise() {
  const Eigen::RowVector2d low = uv_.colwise().minCoeff();
  const Eigen::RowVector2d high = uv_.colwise().maxCoeff();
  trial_ = uv_.rowwise() - 0.5 * (low + high);
  // A power of two: changes no triangle's sign.
  trial_ *= std::ldexp(1.0, -std::ilogb((high - low).maxCoeff()));
  if (is_flip_free(faces_, trial_, context_)) uv_.swap(trial_);
}

// Brings a free map to the surface's unit; by a power of two if rounding of the exact factor would
// flip something.
void Minimizer::finish_unit() {
  const double factor = rest_.length * sums_.best_scale();
  const Eigen::RowVector2d centre = 0.5 * (uv_.colwise().minCoeff() + uv_.colwise().maxCoeff());
  trial_ = factor * (uv_.rowwise() - centre);
  if (is_flip_free(faces_, trial_, context_)) {
    uv_.swap(trial_);
  } else {
    uv_ *= std::ldexp(1.0, static_cast<int>(std::lround(std::log2(factor))));
  }
}

double Minimizer::line_search(double slope, double energy, bool progressive) {
  double step = std::min(1.0, kShareOfFlip * step_to_first_flip(faces_, uv_, direction_, context_));
  for (; step > kShortestStep; step *= 0.5) {
    move(step);
    if (!trial_.allFinite() || !is_flip_free(faces_, trial_, context_)) continue;
    const EnergySums sums = sum_energy(faces_, working_, trial_, context_);
    const double now = progressive ? sums.value() : sums.at_best_scale();
    if (now <= energy + kSufficientDecrease * step * slope) return step;
    if (std::abs(step * slope) < kEnergyRounding * energy &&
        directional_derivative(faces_, working_, trial_, direction_, context_) <= 0) {
      return step;
    }
  }
  return 0;
}

Minimizer::Step Minimizer::iterate(NewtonSystem& system, bool progressive) {
  if (progressive) {
    // Scale at which the logarithm of the area distortion averages to zero: the best scale would
    // follow the few worst triangles.
    const double scale = std::exp(-0.5 * sums_.log_area);
    progressive_rest(faces_, rest_.triangles, scale, uv_, context_, working_);
  } else {
    scale_rest(rest_.triangles, sums_.best_scale(), context_, working_);
  }
  const double energy = system.assemble(working_, uv_, context_);
  const double slope = system.solve(direction_, context_);
  if (!(slope < 0)) return slope == 0 ? Step::kConverged : Step::kStalled;
  const double step = line_search(slope, energy, progressive);
  if (step == 0) return -slope < kEnergyRounding * energy ? Step::kConverged : Step::kStalled;
  const EnergySums sums = sum_energy(faces_, rest_.triangles, trial_, context_);
  if (progressive && !(sums.at_best_scale() < sums_.at_best_scale())) return Step::kStalled;
  uv_.swap(trial_);
  sums_ = sums;
  return !progressive && -0.5 * slope <= options_.tolerance * energy && step == 1.0
             ? Step::kConverged
             : Step::kTaken;
}

Points2 Minimizer::run(Stats& stats) {
  const Stopwatch watch;
  sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
  stats["distortion.energy_start"] = sums_.at_best_scale();
  NewtonSystem system(faces_, fixed_, uv_, context_);

  int iteration = 0;
  int progressive_iterations = 0;
  bool progressive = true;
  const char* stop = "iteration limit";
  double begin = 0;
  for (; iteration < options_.max_iterations && system.free_vertices() > 0; ++iteration) {
    const double end =
        begin + 0.15 * (1 - begin);  // no bound on the iterations is known: geometric shares
    const ProgressRange range(context_, begin, end);
    context_.report("Reducing distortion", 0.0);
    begin = end;
    progressive = progressive && sums_.worst_at_best_scale() > 10 * kProgressiveBound;
    const Step step = iterate(system, progressive);
    progressive_iterations += progressive ? 1 : 0;
    if (step == Step::kTaken) continue;
    if (progressive) {
      progressive = false;
      continue;
    }
    stop = step == Step::kConverged ? "converged" : "stalled";
    ++iteration;
    break;
  }
  if (options_.fixed.empty()) finish_unit();
  sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
  stats["distortion.energy"] = sums_.at_best_scale();
  stats["distortion.iterations"] = static_cast<std::int64_t>(iteration);
  stats["distortion.progressive_iterations"] = static_cast<std::int64_t>(progressive_iterations);
  stats["distortion.factorizations"] = static_cast<std::int64_t>(system.factorizations());
  stats["distortion.stop"] = std::string(stop);
  stats["distortion.seconds"] = watch.seconds();
  return std::move(uv_);
}

}  // namespace

Points2 minimize_distortion(const Surface& chart, const Points2& initial_uv,
                            const MinimizeOptions& options, ExecutionContext& context,
                            Stats& stats) {
  check_input(chart, initial_uv, options, context);
  Minimizer minimizer(chart, initial_uv, options, context);
  return minimizer.run(stats);
}

}  // namespace flipfree
