#include "flipfree/distortion/minimize.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/distortion/boundary_barrier.h"
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
// Weight of a contact in units of a mean triangle's.
constexpr double kBarrierWeight = 1.0;

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
            ExecutionContext& context);

  Points2 run(Stats& stats);

 private:
  enum class Step { kTaken, kConverged, kStalled };

  void normalise();
  void finish_unit();
  const char* descend();
  Step iterate(bool progressive);
  double assemble(double scale);
  bool add_contacts(const std::vector<BoundaryBarrier::Contact>& contacts);
  double line_search(double slope, double energy, bool progressive);
  bool acceptable();
  // UV length of a surface length 1 when rest shapes are divided by `scale`.
  double unit(double scale) const { return 1.0 / (rest_.length * scale); }

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
  std::optional<NewtonSystem> system_;
  std::optional<BoundaryBarrier> barrier_;  // bijective maps only
  bool barrier_on_ = false;
  double barrier_unit_ = 0;  // unit() of the current step
  double frozen_scale_ = 0;  // with the barrier on, the scale no longer changes between steps
  Points2 one_to_one_;  // last map of the run without barrier whose boundary did not meet itself
  int iterations_ = 0;
  int progressive_iterations_ = 0;
  int factorizations_ = 0;
  double progress_ = 0;
};

Minimizer::Minimizer(const Surface& chart, const Points2& initial, const MinimizeOptions& options,
                     ExecutionContext& context)
    : faces_(chart.faces),
      options_(options),
      context_(context),
      uv_(initial),
      fixed_(static_cast<std::size_t>(initial.rows()), 0),
      rest_(build_rest_shapes(chart, context)) {
  for (const VertexId v : options.fixed) fixed_[static_cast<std::size_t>(v)] = 1;
  if (options.bijective) {
    barrier_.emplace(chart);
    const auto pair = BoundaryGrid(barrier_->boundary(), uv_).first_conflict(context);
    if (pair[0] != kInvalid) {
      const auto& e = barrier_->boundary().edges[static_cast<std::size_t>(pair[0])];
      const auto& f = barrier_->boundary().edges[static_cast<std::size_t>(pair[1])];
      throw_invalid(ErrorCode::kBadOption,
                    "The initial map's boundary meets itself, first at the edges (" +
                        std::to_string(e[0]) + ", " + std::to_string(e[1]) + ") and (" +
                        std::to_string(f[0]) + ", " + std::to_string(f[1]) +
                        "). Unwrap it anew, or allow overlaps.",
                    ElementKind::kEdge, {e[0], e[1], f[0], f[1]});
    }
  }
  if (options.fixed.empty()) normalise();
}

// Exact: may trial_ replace uv_?
bool Minimizer::acceptable() {
  return trial_.allFinite() && is_flip_free(faces_, trial_, context_) &&
         !(barrier_on_ && boundary_conflicts(barrier_->boundary(), trial_, context_));
}

// Without fixed vertices: bounding box centred at the origin, where doubles are densest, and about
// as large as the rest shapes. Kept only if the exact tests still hold.
void Minimizer::normalise() {
  const Eigen::RowVector2d low = uv_.colwise().minCoeff();
  const Eigen::RowVector2d high = uv_.colwise().maxCoeff();
  trial_ = uv_.rowwise() - 0.5 * (low + high);
  // A power of two: changes no triangle's sign.
  trial_ *= std::ldexp(1.0, -std::ilogb((high - low).maxCoeff()));
  barrier_on_ = barrier_.has_value();
  if (acceptable()) uv_.swap(trial_);
  barrier_on_ = false;
}

// Brings a free map to the surface's unit; by a power of two if rounding of the exact factor would
// spoil something.
void Minimizer::finish_unit() {
  const double factor = rest_.length * sums_.best_scale();
  const Eigen::RowVector2d centre = 0.5 * (uv_.colwise().minCoeff() + uv_.colwise().maxCoeff());
  trial_ = factor * (uv_.rowwise() - centre);
  barrier_on_ = barrier_.has_value();
  if (acceptable()) {
    uv_.swap(trial_);
  } else {
    uv_ *= std::ldexp(1.0, static_cast<int>(std::lround(std::log2(factor))));
  }
}

// Longest acceptable step along direction_, 0 if there is none; leaves the new map in trial_.
double Minimizer::line_search(double slope, double energy, bool progressive) {
  double step = std::min(1.0, kShareOfFlip * step_to_first_flip(faces_, uv_, direction_, context_));
  for (; step > kShortestStep; step *= 0.5) {
    trial_ = uv_ + step * direction_;
    if (!acceptable()) continue;
    const EnergySums sums = sum_energy(faces_, working_, trial_, context_);
    double now = progressive || barrier_on_ ? sums.value() : sums.at_best_scale();
    if (barrier_on_)
      now += barrier_->value(trial_, barrier_unit_,
                             kBarrierWeight / static_cast<double>(faces_.rows()));
    if (now <= energy + kSufficientDecrease * step * slope) return step;
    if (std::abs(step * slope) < kEnergyRounding * energy &&
        directional_derivative(faces_, working_, trial_, direction_, context_) <= 0) {
      return step;
    }
  }
  return 0;
}

bool Minimizer::add_contacts(const std::vector<BoundaryBarrier::Contact>& contacts) {
  for (const auto& contact : contacts) {
    const double factor[3] = {1.0, contact.t - 1.0, -contact.t};
    const Vector2& n = contact.normal;
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) {
        const double c = contact.curvature * factor[i] * factor[j];
        const double block[3] = {c * n.x() * n.x(), c * n.x() * n.y(), c * n.y() * n.y()};
        if (i != j) {
          if (!system_->add_pair(contact.vertices[static_cast<std::size_t>(i)],
                                 contact.vertices[static_cast<std::size_t>(j)], block)) {
            return false;
          }
          continue;
        }
        const double gradient[2] = {contact.slope * factor[i] * n.x(),
                                    contact.slope * factor[i] * n.y()};
        system_->add(contact.vertices[static_cast<std::size_t>(i)], gradient, block);
      }
    }
  }
  return true;
}

// Gradient and Hessian at uv_ for the working rest shapes; returns the energy. The system's pattern
// is extended when parts of the boundary come near each other that were not before.
double Minimizer::assemble(double scale) {
  if (!barrier_on_) {
    if (!system_)
      system_.emplace(faces_, fixed_, uv_, std::vector<std::array<VertexId, 2>>{}, context_);
    return system_->assemble(working_, uv_, context_);
  }
  barrier_unit_ = unit(scale);
  const auto contacts =
      barrier_->contacts(uv_, barrier_unit_, kBarrierWeight / static_cast<double>(faces_.rows()));
  double energy = 0;
  const auto all = [&] {
    energy = system_->assemble(working_, uv_, context_);
    return add_contacts(contacts);
  };
  if (!system_ || !all()) {
    system_.emplace(faces_, fixed_, uv_, barrier_->couplings(uv_, barrier_unit_), context_);
    if (!all()) throw InternalError("a contact of the boundary barrier is missing in the pattern");
  }
  for (const auto& contact : contacts) energy += contact.value;
  return energy;
}

Minimizer::Step Minimizer::iterate(bool progressive) {
  double scale = sums_.best_scale();
  if (progressive) {
    // Scale at which the logarithm of the area distortion averages to zero: the best scale would
    // follow the few worst triangles.
    scale = std::exp(-0.5 * sums_.log_area);
    progressive_rest(faces_, rest_.triangles, scale, uv_, context_, working_);
  } else {
    if (barrier_on_ && frozen_scale_ == 0) frozen_scale_ = scale;
    if (barrier_on_) scale = frozen_scale_;
    scale_rest(rest_.triangles, scale, context_, working_);
  }
  const double energy = assemble(scale);
  const double slope = system_->solve(direction_, context_);
  ++factorizations_;
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

// Steps until nothing is to be gained; returns why it stopped.
const char* Minimizer::descend() {
  bool progressive = true;
  for (int i = 0; i < options_.max_iterations; ++i) {
    const double end =
        progress_ + 0.15 * (1 - progress_);  // no bound on the steps is known: geometric shares
    const ProgressRange range(context_, progress_, end);
    context_.report("reducing distortion", 0.0);
    progress_ = end;
    progressive = progressive && sums_.worst_at_best_scale() > 10 * kProgressiveBound;
    const Step step = iterate(progressive);
    ++iterations_;
    progressive_iterations_ += progressive ? 1 : 0;
    if (step == Step::kTaken) {
      if (barrier_ && !barrier_on_ && !boundary_conflicts(barrier_->boundary(), uv_, context_))
        one_to_one_ = uv_;
      continue;
    }
    if (!progressive) return step == Step::kConverged ? "converged" : "stalled";
    progressive = false;
  }
  return "iteration limit";
}

Points2 Minimizer::run(Stats& stats) {
  const Stopwatch watch;
  sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
  stats["distortion.energy_start"] = sums_.at_best_scale();
  const char* stop = "converged";
  const bool all_fixed = std::all_of(fixed_.begin(), fixed_.end(), [](char f) { return f != 0; });
  if (!all_fixed) {
    if (barrier_) one_to_one_ = uv_;
    stop = descend();
    if (barrier_ && boundary_conflicts(barrier_->boundary(), uv_, context_)) {
      uv_ = std::move(one_to_one_);
      sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
      barrier_on_ = true;
      system_.reset();
      stop = descend();
    }
  }
  stats["distortion.barrier"] = static_cast<std::int64_t>(barrier_on_);
  if (options_.fixed.empty()) finish_unit();
  sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
  stats["distortion.energy"] = sums_.at_best_scale();
  stats["distortion.iterations"] = static_cast<std::int64_t>(iterations_);
  stats["distortion.progressive_iterations"] = static_cast<std::int64_t>(progressive_iterations_);
  stats["distortion.factorizations"] = static_cast<std::int64_t>(factorizations_);
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
