#include "flipfree/distortion/minimize/minimizer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::distortion {

namespace {

// A map with a larger mean is not taken for somebody who accepts it as it is: nothing can be done
// with it, and 32 bits may not hold it.
constexpr double kBearableEnergy = 100.0;
// Below this it ends at once, above once a step leaves more than this share of what exceeds 1.
constexpr double kGoodEnergy = 1.5;
constexpr double kFastStep = 0.8;
// Longest one, in full steps, with MinimizeOptions::lengthen.
constexpr double kLongestStep = 8;
// A step that gains less than this share of the tolerance is hindered, by contacts or by triangles
// that are drawn out, and so is the next: a map that is good enough ends there.
constexpr double kLeastGain = 0.1;
// Of the progress, what the progressive steps take; what a step adds at least, of what is left;
// where it waits for the end.
constexpr double kProgressiveShare = 0.3;
constexpr double kLeastProgress = 0.01;
constexpr double kMostProgress = 0.98;
// Weight of a contact in units of a mean triangle's.
constexpr double kBarrierWeight = 1.0;
// Reach of the barrier while the map is far from its target, in units of the ordinary reach; it is
// halved whenever a step promises less than the share kSettled of the energy.
constexpr double kFarReach = 8.0;
constexpr double kSettled = 5e-3;
// Targets go this far towards the first flip at once, with so many steps of recovery in between;
// they have got stuck when this many rounds in a row brought them no more than a hundredth nearer.
constexpr double kPullShare = 0.7;
constexpr int kRecoveries = 3;
constexpr int kIdlePulls = 8;

// Relative to the mean diagonal: keeps the matrix definite (its kernel are the translations and, on
// developable surfaces, the similarities) without moving the smallest other eigenvectors visibly.
constexpr double kShift = 1e-11;
constexpr int kInverseIterations = 5;

// Lower triangle of the conformal energy (Dirichlet energy with cotangent weights, minus the image
// area); unknown 2 v + d is coordinate d of v. The area is a sum over boundary edges ij of (x_i y_j
// - x_j y_i) / 2, so that the two coordinates meet at the boundary only.
numeric::SparseMatrix conformal_energy(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                                       const ExecutionContext& context) {
  const auto n = static_cast<Index>(chart.vertices.rows());
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(at(6 * chart.faces.size()));
  const auto add = [&](Index i, Index j, double value) {
    entries.emplace_back(std::max(i, j), std::min(i, j), value);
  };
  double trace = 0.0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(chart.faces.size()); ++h) {
    if (h % 8192 == 0) context.check();
    const VertexId v = mesh::source(chart.faces, h), w = mesh::target(chart.faces, h);
    const auto [a, b] = mesh::sides_at(chart, previous_corner(h));
    const double weight = 0.5 * a.dot(b) / a.cross(b).norm();
    for (Index d = 0; d < 2; ++d) {
      add(2 * v + d, 2 * v + d, weight);
      add(2 * w + d, 2 * w + d, weight);
      add(2 * v + d, 2 * w + d, -weight);
    }
    trace += 4 * weight;
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    add(2 * v, 2 * w + 1, -0.5);
    add(2 * v + 1, 2 * w, 0.5);
  }
  const double shift = kShift * trace / (2.0 * n);
  for (Index i = 0; i < 2 * n; ++i) add(i, i, shift);
  numeric::SparseMatrix matrix(2 * n, 2 * n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  context.check();
  return matrix;
}

// One run of the method; the state that its steps share.
class Minimizer {
 public:
  Minimizer(DescentStart start, const MinimizeOptions& options, ExecutionContext& context)
      : start_(std::move(start)),
        faces_(start_.faces),
        options_(options),
        context_(context),
        uv_(start_.uv),
        fixed_(at(uv_.rows()), 0),
        rest_(std::move(start_.rest)) {
    for (const VertexId v : options.fixed) fixed_[at(v)] = 1;
    if (options.bijective) barrier_.emplace(*start_.surface);
    if (options.fixed.empty()) normalise();
    if (options.unit > 0) {
      rest_.triangles = scaled_rest(rest_.triangles, 1.0 / (rest_.length * options.unit), context_);
      rest_.length = 1.0 / options.unit;
    }
  }

  Minimized run() {
    std::optional<ProgressRange> range;
    if (start_.motion_left) {
      range.emplace(context_, 0.0, 0.5);
      done_.fraction = pull();
      // Other translations are reached, or the map is no use.
      if (start_.steps != nullptr && done_.fraction < 1) return std::move(done_);
      range.emplace(context_, 0.5, 1.0);
    }
    if (barrier_) system_.reset();  // its contacts were those of the way
    sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
    if (std::find(fixed_.begin(), fixed_.end(), char{0}) != fixed_.end()) {
      if (barrier_) one_to_one_ = uv_;
      if (barrier_ && options_.held_apart) hold_apart();
      done_.stop = descend();
      if (!barrier_on_ && overlaps()) {
        if (options_.overlapping == nullptr) {
          hold_apart();
          done_.stop = descend();
        } else {
          done_.stop = Stop::kOverlap;
        }
      }
    }
    const Grace finishing(context_);
    if (options_.fixed.empty()) finish_unit();
    sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
    done_.energy = measure(sums_);
    done_.uv = std::move(uv_);
    return std::move(done_);
  }

 private:
  enum class Step { kTaken, kConverged, kStalled };

  StepSystem& steps() { return start_.steps != nullptr ? *start_.steps : *system_; }
  // Energies, and by how much to divide rest lengths for them: at the best scale, or at the unit
  // that was given, to which rest_ is brought at the start.
  double scale_of(const EnergySums& sums) const {
    return options_.unit > 0 ? 1.0 : sums.best_scale();
  }
  double measure(const EnergySums& sums) const {
    return options_.unit > 0 ? sums.value() : sums.at_best_scale();
  }
  double worst(const EnergySums& sums) const {
    return options_.unit > 0 ? sums.worst_stretch + sums.worst_shrink : sums.worst_at_best_scale();
  }

  // Exact: may trial_ replace uv_?
  bool acceptable() {
    return trial_.allFinite() && is_flip_free(faces_, trial_, context_) &&
           !(barrier_on_ && overlaps_itself(barrier_->boundary(), trial_, context_));
  }

  // Without fixed vertices: bounding box centred at the origin, where doubles are densest, and
  // about as large as the rest shapes. Kept only if the exact tests still hold.
  void normalise() {
    const Eigen::RowVector2d low = uv_.colwise().minCoeff();
    const Eigen::RowVector2d high = uv_.colwise().maxCoeff();
    trial_ = uv_.rowwise() - 0.5 * (low + high);
    // A power of two: changes no triangle's sign.
    trial_ *= std::ldexp(1.0, -std::ilogb((high - low).maxCoeff()));
    barrier_on_ = barrier_.has_value();
    if (acceptable()) uv_.swap(trial_);
    barrier_on_ = false;
  }

  // Brings a free map to the surface's unit; by a power of two if rounding of the exact factor
  // would spoil something.
  void finish_unit() {
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
  double line_search(double slope, double energy, bool progressive) {
    const double most =
        std::min(1.0, kShareOfFlip * step_to_first_flip(faces_, uv_, direction_, context_));
    double now = energy;
    bool enough = false;
    const double found = halved_step(most, uv_, direction_, trial_, [&](double step) {
      if (!acceptable()) return false;
      const EnergySums sums = sum_energy(faces_, working_, trial_, context_);
      now = progressive || barrier_on_ ? sums.value() : measure(sums);
      if (barrier_on_) now += barrier_->value(trial_, reach_);
      enough = now <= energy + kSufficientDecrease * step * slope;
      return enough ||
             (std::abs(step * slope) < kEnergyRounding * energy &&
              directional_derivative(faces_, working_, trial_, direction_, context_) <= 0);
    });
    const bool may = options_.lengthen && enough && found == 1.0 && !progressive && !barrier_on_;
    return may ? lengthen(now) : found;
  }

  // The full step is in trial_ and has energy `now`: doubles it while the energy falls. Returns the
  // factor.
  double lengthen(double now) {
    const double most = kShareOfFlip * step_to_first_flip(faces_, uv_, direction_, context_);
    Points2 longer;
    double step = 1.0;
    while (2 * step <= std::min(most, kLongestStep)) {
      longer = uv_ + 2 * step * direction_;
      if (!is_flip_free(faces_, longer, context_)) break;
      const double then = measure(sum_energy(faces_, working_, longer, context_));
      if (!(then < now)) break;
      now = then;
      step *= 2;
      trial_.swap(longer);
    }
    return step;
  }

  // Gradient and Hessian at uv_ for the working rest shapes, which are divided by `scale`; returns
  // the energy. The system's pattern is extended when parts of the boundary come near each other
  // that were not before.
  double assemble(double scale, bool soft, const Points2& motion = {}) {
    const FaceEnergy of_face = symmetric_dirichlet_energy(faces_, working_, uv_, soft);
    if (barrier_on_) {
      reach_ = {1.0 / (rest_.length * scale), soft ? kFarReach : reach_factor_,
                kBarrierWeight / static_cast<double>(faces_.rows())};
    }
    double energy = 0;
    const auto all = [&] {
      steps().prescribe(motion);
      energy = steps().assemble(of_face, context_);
      return !barrier_on_ || barrier_->add_to(*system_, uv_, reach_, energy);
    };
    if ((start_.steps != nullptr || system_) && all()) return energy;
    std::vector<std::array<VertexId, 2>> couplings;
    if (barrier_on_) couplings = barrier_->couplings(uv_, reach_);
    system_.emplace(faces_, fixed_, couplings, context_);
    if (!all()) throw InternalError("a contact of the boundary barrier is missing in the pattern");
    return energy;
  }

  Step iterate(bool progressive) {
    double scale = scale_of(sums_);
    if (progressive) {
      // Scale at which the logarithm of the area distortion averages to zero: the best scale would
      // follow the few worst triangles.
      if (options_.unit == 0) scale = std::exp(-0.5 * sums_.log_area);
      working_ = progressive_rest(faces_, rest_.triangles, scale, uv_, context_);
    } else {
      if (barrier_on_ && frozen_scale_ == 0) frozen_scale_ = scale;
      if (barrier_on_) scale = frozen_scale_;
      working_ = scaled_rest(rest_.triangles, scale, context_);
    }
    const double energy = assemble(scale, progressive);
    const double slope = steps().solve(direction_, context_);
    ++done_.factorizations;
    if (!(slope < 0)) return slope == 0 ? Step::kConverged : Step::kStalled;
    const double step = line_search(slope, energy, progressive);
    if (step == 0) return -slope < kEnergyRounding * energy ? Step::kConverged : Step::kStalled;
    const EnergySums sums = sum_energy(faces_, rest_.triangles, trial_, context_);
    if (progressive && !(measure(sums) < measure(sums_))) return Step::kStalled;
    uv_.swap(trial_);
    sums_ = sums;
    const double promise = -0.5 * slope / energy;
    const bool hindered =
        measure(sums_) <= options_.enough && step * promise <= kLeastGain * options_.tolerance;
    if (progressive) {
      // The worst triangle on its way to where true rest shapes take over.
      first_worst_ = std::max(first_worst_, worst(sums_));
      advance(kProgressiveShare, 0.0, worst(sums_), first_worst_, 10 * kProgressiveBound);
      return hindered ? Step::kConverged : Step::kTaken;
    }
    first_promise_ = std::max(first_promise_, promise);
    advance(1.0, kProgressiveShare, promise, first_promise_, options_.tolerance);
    if (barrier_on_ && reach_factor_ > 1) {
      // Far reach keeps parts apart for longer steps; it is drawn in as the map settles.
      if (promise < kSettled) reach_factor_ = std::max(1.0, 0.5 * reach_factor_);
      return Step::kTaken;
    }
    return hindered || (promise <= options_.tolerance && step >= 1.0) ? Step::kConverged
                                                                      : Step::kTaken;
  }

  // A figure on its way from its largest value to its goal, by orders of magnitude, moves the
  // progress from `begin` to `end`. It never falls back, and always a little forward: no bound on
  // the steps is known.
  void advance(double end, double begin, double now, double first, double goal) {
    const double whole = std::log(first / goal);
    const double gone = whole > 0 ? std::clamp(std::log(first / now) / whole, 0.0, 1.0) : 0.0;
    const double estimate = begin + (end - begin) * gone;
    progress_ =
        std::max(progress_ + kLeastProgress * (1 - progress_), std::min(estimate, kMostProgress));
  }

  // Steps until nothing is to be gained, or time is over; returns why it stopped. A step that is
  // not finished leaves uv_ and one_to_one_ as they were.
  Stop descend() try {
    bool progressive = true;
    std::optional<MapInHand> in_hand;
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; i < options_.max_iterations; ++i) {
      const double energy = measure(sums_);
      const bool slow = energy - 1 > kFastStep * (before - 1);
      if (options_.acceptable && (energy <= kGoodEnergy || (slow && energy <= kBearableEnergy)))
        in_hand.emplace(context_);
      before = energy;
      // What a step's parts report stays within the least that it adds.
      const ProgressRange range(context_, progress_, progress_ + kLeastProgress * (1 - progress_));
      context_.report("reducing distortion", 0.0);
      progressive = progressive && worst(sums_) > 10 * kProgressiveBound;
      Step step = Step::kStalled;
      try {
        step = iterate(progressive);
      } catch (const NotConverged& failure) {
        if (!options_.keep_last || failure.error().code != ErrorCode::kFactorizationFailed) throw;
        if (!progressive) return Stop::kNotFactorized;
        system_.reset();  // true rest shapes may do
      }
      ++done_.iterations;
      if (step == Step::kTaken) {
        if (barrier_ && !barrier_on_) {
          if (!overlaps_itself(barrier_->boundary(), uv_, context_)) {
            one_to_one_ = uv_;
          } else if (options_.ends_at_overlap) {
            return Stop::kOverlap;
          }
        }
        continue;
      }
      if (!progressive && reach_factor_ > 1) {
        reach_factor_ = 1;
        continue;
      }
      if (!progressive) return step == Step::kConverged ? Stop::kConverged : Stop::kStalled;
      progressive = false;
    }
    return Stop::kIterationLimit;
  } catch (const TimeIsOver&) {
    return Stop::kTimeLimit;
  }

  // Does uv_ overlap itself, where it may not? Then uv_ becomes the last map that did not.
  bool overlaps() {
    const Grace deciding(context_);
    if (!barrier_ || !overlaps_itself(barrier_->boundary(), uv_, context_)) return false;
    if (options_.overlapping != nullptr) *options_.overlapping = uv_;
    uv_ = std::move(one_to_one_);
    sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
    return true;
  }

  void hold_apart() {
    barrier_on_ = true;
    reach_factor_ = kFarReach;
    system_.reset();
  }

  // The Newton step with the remaining motion prescribed: minimises the quadratic model over all
  // that is free. It goes as far as triangles stay open, then the map recovers, and again. Returns
  // the share of the way that was gone, 1 if all was.
  double pull() {
    barrier_on_ = barrier_.has_value();
    sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
    Points2 motion = start_.motion_left(uv_);
    const double whole = motion.rowwise().norm().sum();
    double left = whole;
    int idle = 0;
    for (int round = 0; left > 0 && round < options_.max_pulls && idle < kIdlePulls; ++round) {
      const ProgressRange range(context_, progress_, 1.0);
      context_.report("moving to the targets", 0.5 * (1 - left / whole));
      frozen_scale_ = scale_of(sums_);
      working_ = scaled_rest(rest_.triangles, frozen_scale_, context_);
      assemble(frozen_scale_, false, motion);
      steps().solve(direction_, context_);
      ++done_.factorizations;
      const double most =
          std::min(1.0, kPullShare * step_to_first_flip(faces_, uv_, direction_, context_));
      const double gone = halved_step(most, uv_, direction_, trial_, [&](double step) {
        if (step == 1.0 && start_.arrive) start_.arrive(trial_);
        return acceptable();
      });
      if (gone > 0) {
        uv_.swap(trial_);
        sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
      } else {
        ++idle;
      }
      motion = start_.motion_left(uv_);
      const double now = gone == 1.0 ? 0.0 : motion.rowwise().norm().sum();
      idle = now < 0.99 * left ? 0 : idle + 1;
      left = now;
      for (int i = 0; i < kRecoveries && left > 0; ++i) {
        frozen_scale_ = 0;
        Step result = Step::kStalled;
        try {
          result = iterate(worst(sums_) > 10 * kProgressiveBound);
        } catch (const NotConverged& failure) {
          if (!options_.keep_last || failure.error().code != ErrorCode::kFactorizationFailed) throw;
        }
        ++done_.iterations;
        if (result != Step::kTaken) break;
      }
    }
    frozen_scale_ = 0;
    barrier_on_ = false;
    return whole > 0 ? 1 - left / whole : 1.0;
  }

  DescentStart start_;
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
  BoundaryBarrier::Reach reach_;  // of the current step
  double reach_factor_ = 1;
  double frozen_scale_ = 0;  // with the barrier on, the scale no longer changes between steps
  Points2 one_to_one_;  // last map of the run without barrier whose boundary did not meet itself
  Minimized done_;
  double progress_ = 0;
  double first_worst_ = 0;  // largest figures of the descent, for the progress
  double first_promise_ = 0;
};

}  // namespace

Minimized descend(DescentStart start, const MinimizeOptions& options, ExecutionContext& context) {
  return Minimizer(std::move(start), options, context).run();
}

void report(const Minimized& descent, Stats& stats) {
  constexpr std::array kStops = {"converged",  "stalled", "iteration limit",
                                 "time limit", "overlap", "not factorized"};
  stats["distortion.iterations"] = static_cast<std::int64_t>(descent.iterations);
  stats["distortion.energy"] = descent.energy;
  stats["distortion.stop"] = std::string(kStops.at(static_cast<std::size_t>(descent.stop)));
}

void check_start(const mesh::Surface& chart, const Points2& uv, const MinimizeOptions& options,
                 const ExecutionContext& context) {
  if (chart.faces.rows() == 0) throw_invalid(ErrorCode::kEmptyMesh, "The chart has no faces.");
  if (uv.rows() != chart.vertices.rows()) {
    throw_invalid(ErrorCode::kBadShape, "The initial map has " + std::to_string(uv.rows()) +
                                            " points for " + std::to_string(chart.vertices.rows()) +
                                            " vertices.");
  }
  for (const VertexId v : options.fixed) {
    if (v < 0 || v >= uv.rows()) {
      throw_invalid(ErrorCode::kBadPins, "Fixed vertex " + vertex_id(v) + " does not exist.",
                    ElementKind::kVertex, {v});
    }
  }
  auto flipped = flipped_faces(chart.faces, uv, context);
  if (!flipped.empty()) {
    const std::string count = std::to_string(flipped.size());
    const std::string first = face_id(flipped.front());
    throw_invalid(ErrorCode::kFlippedMap,
                  "The initial map has " + count +
                      " flipped or collapsed triangles, the first is face " + first +
                      ". Unwrap it instead of improving it.",
                  ElementKind::kFace, first_elements(flipped));
  }
  if (options.bijective) {
    const Boundary boundary = find_boundary(static_cast<Index>(uv.rows()), chart.faces);
    const auto pairs = BoundaryGrid(boundary, uv).conflicts(1, context);
    if (!pairs.empty()) {
      const auto& e = boundary.edges[at(pairs[0][0])];
      const auto& f = boundary.edges[at(pairs[0][1])];
      throw_invalid(ErrorCode::kBadOption,
                    "The initial map's boundary meets itself, first at the edges (" +
                        vertex_id(e[0]) + ", " + vertex_id(e[1]) + ") and (" + vertex_id(f[0]) +
                        ", " + vertex_id(f[1]) + "). Unwrap it anew, or allow overlaps.",
                    ElementKind::kEdge, {e[0], e[1], f[0], f[1]});
    }
    const auto turned = turned_loops(boundary, uv);
    if (!turned.empty()) {
      const std::vector<VertexId>& loop = boundary.loops[turned.front()];
      throw_invalid(ErrorCode::kBadOption,
                    "The initial map covers points twice: the hole or slit at vertex " +
                        vertex_id(loop.front()) +
                        " is turned inside out. Unwrap it anew, or allow overlaps.",
                    ElementKind::kVertex, {loop.front()});
    }
  }
}

Minimized minimize_distortion(const mesh::Surface& chart, const Points2& initial_uv,
                              const MinimizeOptions& options, ExecutionContext& context) {
  check_start(chart, initial_uv, options, context);
  return descend({chart.faces, build_rest_shapes(chart, context), initial_uv, nullptr, &chart},
                 options, context);
}

namespace {

// The map turned, scaled and moved as a whole to where the targets are met best in the mean, if the
// exact tests still hold.
Points2 nearest_to(const std::vector<std::pair<VertexId, Vector2>>& targets, const Triangles& faces,
                   const Points2& uv, bool bijective, const ExecutionContext& context) {
  Points2 from(static_cast<Eigen::Index>(targets.size()), 2), to = from;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    from.row(static_cast<Eigen::Index>(i)) = uv.row(targets[i].first);
    to.row(static_cast<Eigen::Index>(i)) = targets[i].second.transpose();
  }
  Similarity motion = fit_similarity(from, to);
  // Targets that are reflected or scattered have no direction; then only the size is taken over.
  const double size = std::sqrt((to.rowwise() - to.colwise().mean()).squaredNorm() /
                                (from.rowwise() - from.colwise().mean()).squaredNorm());
  if (std::isnormal(size) && motion.linear.norm() < 0.2 * size)
    motion = about_means({size, 0.0}, from, to);
  const Points2 moved_there = moved(motion, uv);
  const bool good = moved_there.allFinite() && is_flip_free(faces, moved_there, context) &&
                    !(bijective && overlaps_itself(faces, moved_there, context));
  return good ? moved_there : uv;
}

}  // namespace

TargetsResult minimize_with_targets(const mesh::Surface& chart, const Points2& initial_uv,
                                    const std::vector<std::pair<VertexId, Vector2>>& targets,
                                    const MinimizeOptions& options, ExecutionContext& context) {
  MinimizeOptions held = options;
  for (const auto& [v, target] : targets) {
    held.fixed.push_back(v);
    if (!target.allFinite()) {
      throw_invalid(ErrorCode::kBadPins,
                    "The target of vertex " + vertex_id(v) + " is not finite. Correct it.",
                    ElementKind::kVertex, {v});
    }
  }
  std::sort(held.fixed.begin(), held.fixed.end());
  const auto twice = std::adjacent_find(held.fixed.begin(), held.fixed.end());
  if (twice != held.fixed.end()) {
    throw_invalid(ErrorCode::kBadPins,
                  "Vertex " + vertex_id(*twice) + " is pinned twice. Give it one place.",
                  ElementKind::kVertex, {*twice});
  }
  check_start(chart, initial_uv, held, context);
  Points2 uv = initial_uv;
  if (options.fixed.empty() && !targets.empty())
    uv = nearest_to(targets, chart.faces, uv, options.bijective, context);
  DescentStart start{chart.faces, build_rest_shapes(chart, context), uv, nullptr, &chart};
  start.arrive = [&](Points2& map) {
    for (const auto& [v, target] : targets) map.row(v) = target.transpose();
  };
  start.motion_left = [&](const Points2& map) {
    Points2 motion = Points2::Zero(map.rows(), 2);
    for (const auto& [v, target] : targets) motion.row(v) = target.transpose() - map.row(v);
    return motion;
  };
  TargetsResult result;
  static_cast<Minimized&>(result) = descend(std::move(start), held, context);
  for (const auto& [v, target] : targets) {
    if (result.uv.row(v) != target.transpose()) result.missed.push_back(v);
  }
  std::sort(result.missed.begin(), result.missed.end());
  return result;
}

Points2 spectral_conformal_map(const mesh::Surface& chart, const Points2& seed,
                               ExecutionContext& context) {
  const Eigen::Index n = chart.vertices.rows();
  const mesh::Adjacency& adjacency = chart.adjacency();
  const numeric::SparseMatrix matrix = conformal_energy(chart, adjacency, context);
  numeric::SparseCholesky cholesky;
  cholesky.analyze(matrix, context);
  if (!cholesky.factorize(matrix, context)) return Points2(0, 2);

  // Inverse iteration for the smallest eigenvectors with mass on the boundary only, translations
  // projected out.
  std::vector<double> mass(at(n), 0.0);
  double total = 0.0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * chart.faces.rows()); ++h) {
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    for (const VertexId v : {mesh::source(chart.faces, h), mesh::target(chart.faces, h)}) {
      mass[at(v)] += 1.0;
      total += 1.0;
    }
  }
  const auto centre_and_normalise = [&](Eigen::VectorXd& x) {
    Vector2 mean = Vector2::Zero();
    for (Eigen::Index v = 0; v < n; ++v) mean += mass[at(v)] * x.segment<2>(2 * v);
    mean /= total;
    double square = 0.0;
    for (Eigen::Index v = 0; v < n; ++v) {
      x.segment<2>(2 * v) -= mean;
      square += mass[at(v)] * x.segment<2>(2 * v).squaredNorm();
    }
    x /= std::sqrt(square);
  };
  Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(seed.data(), 2 * n);
  centre_and_normalise(x);
  for (int iteration = 0; iteration < kInverseIterations; ++iteration) {
    Eigen::VectorXd rhs = x;
    for (Eigen::Index v = 0; v < n; ++v) rhs.segment<2>(2 * v) *= mass[at(v)];
    x = cholesky.solve(rhs, context);
    centre_and_normalise(x);
    if (!x.allFinite()) return Points2(0, 2);
  }
  return Eigen::Map<const Points2>(x.data(), n, 2);
}

}  // namespace flipfree::distortion
