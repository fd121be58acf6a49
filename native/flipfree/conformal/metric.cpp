#include "flipfree/conformal/metric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/stats.h"
#include "flipfree/conformal/newton.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::conformal {

std::string number_text(double value, int digits) {
  std::ostringstream text;
  text << std::setprecision(digits) << value;
  return text.str();
}

namespace {

using std::numbers::pi;

void check_options(const MetricOptions& options) {
  if (!(options.tolerance > 0.0) || !std::isfinite(options.tolerance)) {
    throw_invalid(ErrorCode::kBadOption, "tolerance must be a positive number of radians.");
  }
  if (options.bits != 0 && (options.bits < 53 || options.bits > kLargestBits)) {
    throw_invalid(ErrorCode::kBadOption,
                  "precision must be \"auto\" or 53 to 4096 mantissa bits, not " +
                      std::to_string(options.bits) + ".");
  }
}

// Lengths per edge from lengths per corner; both sides must agree and every face be a proper
// triangle.
std::vector<double> edge_lengths(const intrinsic::IntrinsicSetup& setup, const Points3& lengths) {
  std::vector<double> result(setup.mesh.edge_count(), 0.0);
  for (Eigen::Index f = 0; f < lengths.rows(); ++f) {
    const auto l = lengths.row(f);
    const bool proper = l.allFinite() && l.minCoeff() > 0.0 && l[0] + l[1] > l[2] &&
                        l[1] + l[2] > l[0] && l[2] + l[0] > l[1];
    if (!proper) {
      throw_invalid(ErrorCode::kZeroAreaFace,
                    "The lengths of face " + face_id(f) + " (" + number_text(l[0]) + ", " +
                        number_text(l[1]) + ", " + number_text(l[2]) +
                        ") do not satisfy the strict triangle inequality. Correct them.",
                    ElementKind::kFace, {static_cast<Index>(f)});
    }
    for (int k = 0; k < 3; ++k) {
      const HalfedgeId h = setup.input_halfedge[static_cast<std::size_t>(3 * f + k)];
      double& stored = result[static_cast<std::size_t>(h >> 1)];
      if (stored != 0.0 && std::abs(stored - l[k]) > 1e-12 * stored) {
        throw_invalid(ErrorCode::kBadShape,
                      "The two faces at the edge from corner " + std::to_string(k) + " of face " +
                          face_id(f) + " give it different lengths, " + number_text(stored) +
                          " and " + number_text(l[k]) + ". Make them equal.",
                      ElementKind::kFace, {static_cast<Index>(f)});
      }
      if (stored == 0.0) stored = l[k];
    }
  }
  if (setup.mesh.symmetric()) {
    for (std::size_t e = 0; e < result.size(); ++e) {
      const HalfedgeId r = setup.mesh.reflection[2 * e];
      if (result[e] == 0.0) result[e] = result[static_cast<std::size_t>(r >> 1)];
    }
  }
  return result;
}

// The engine's input without targets. `lengths`: #F x 3 (metric.h), or null: those of the vertex
// positions. Throws InvalidInput as compute_conformal_metric(). With lengths the positions are not
// read.
EngineInput checked_input(const mesh::Surface& surface, const Points3* lengths,
                          const MetricOptions& options) {
  check_options(options);
  if (lengths != nullptr && lengths->rows() != surface.faces.rows())
    throw_invalid(ErrorCode::kBadShape, "lengths must have one row per face.");
  mesh::ValidateOptions rules = kConnected;
  rules.reject_zero_area = lengths == nullptr;
  const std::vector<Error> defects =
      lengths == nullptr
          ? mesh::find_defects(surface, rules)
          : mesh::find_defects({Points3::Zero(surface.vertices.rows(), 3), surface.faces}, rules);
  if (!defects.empty()) throw InvalidInput(defects.front());
  EngineInput input = input_of(surface);
  if (lengths != nullptr) {
    input.positions = nullptr;
    input.edge_length = edge_lengths(input.setup, *lengths);
  }
  return input;
}

// Positive, finite, one per vertex, and meeting Gauss-Bonnet: the angles of #F triangles sum to pi
// #F. What rounding leaves of the remainder is spread evenly. Returns the targets to solve for.
std::vector<double> checked_targets(const std::vector<double>& target, const EngineInput& input,
                                    double tolerance) {
  const intrinsic::IntrinsicSetup& setup = input.setup;
  const Index vertex_count = input.vertex_count;
  const auto face_count = static_cast<Index>(setup.input_halfedge.size() / 3);
  // A boundary has as many edges as vertices.
  const auto boundary =
      static_cast<Index>(std::count(setup.on_boundary.begin(), setup.on_boundary.end(), true));
  const Index euler = vertex_count - (face_count + boundary) / 2;
  if (target.size() != static_cast<std::size_t>(vertex_count)) {
    throw_invalid(ErrorCode::kBadShape, "target_angles has " + std::to_string(target.size()) +
                                            " entries for " + std::to_string(vertex_count) +
                                            " vertices. Give one angle per vertex.");
  }
  std::vector<Index> bad;
  for (std::size_t v = 0; v < target.size(); ++v) {
    if (!(target[v] > 0.0) || !std::isfinite(target[v])) bad.push_back(static_cast<Index>(v));
  }
  if (!bad.empty()) {
    throw_invalid(
        ErrorCode::kBadAngles,
        "The target angle of vertex " + vertex_id(bad.front()) +
            " is not a positive number. Every angle must be greater than 0 (flat interior is 2 pi, "
            "straight boundary pi).",
        ElementKind::kVertex, first_elements(bad));
  }
  long double sum = 0.0L;
  long double curvature = 0.0L;
  for (std::size_t v = 0; v < target.size(); ++v) {
    sum += target[v];
    curvature += (setup.on_boundary[v] ? 1.0L : 2.0L) * std::numbers::pi_v<long double> - target[v];
  }
  const long double missing = std::numbers::pi_v<long double> * face_count - sum;
  const double share = static_cast<double>(missing / vertex_count);
  if (std::abs(share) > std::max(0.5 * tolerance, 1e-12)) {
    throw_infeasible(ErrorCode::kGaussBonnet,
                     "The prescribed curvatures sum to " +
                         number_text(static_cast<double>(curvature)) +
                         ", but 2 pi times the Euler "
                         "characteristic " +
                         std::to_string(euler) + " is " + number_text(2.0 * pi * euler) +
                         " (Gauss-Bonnet). Add " + number_text(static_cast<double>(missing)) +
                         " radians (" + number_text(static_cast<double>(missing) / (0.5 * pi)) +
                         " quarter turns) to the sum of the target angles.",
                     {"angle sum",
                      {{"sum", {static_cast<double>(sum)}},
                       {"needed", {pi * static_cast<double>(face_count)}}}});
  }
  std::vector<double> spread = target;
  for (double& t : spread) t += share;
  return spread;
}

// Flips per edge from which on a direct way is worth its search: an overlay replays a flip in some
// 50 ns, while the search costs about a microsecond per edge.
constexpr std::size_t kLongWay = 4;
constexpr double kFineAngles =
    1e-13;                           // radians: what the angles of a result are known to, at least
constexpr double kFinishing = 0.05;  // seconds
constexpr int kMostPinnedSteps = 100;

// The input face whose sides come nearest to breaking the triangle inequality, as doubles see it.
FaceId flattest_face(const EngineInput& input) {
  const intrinsic::IntrinsicSetup& setup = input.setup;
  FaceId flattest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < setup.input_halfedge.size(); c += 3) {
    std::array<double, 3> side{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto h = static_cast<std::size_t>(setup.input_halfedge[c + k]);
      const auto end = [&](std::size_t i) {
        return setup.mesh.unknown[static_cast<std::size_t>(setup.mesh.origin[i])];
      };
      side[k] =
          input.positions == nullptr
              ? input.edge_length[h / 2]
              : (input.positions->row(end(h)) - input.positions->row(end(h ^ 1))).stableNorm();
    }
    std::sort(side.begin(), side.end());
    const double excess = ((side[0] - side[2]) + side[1]) / side[2];
    if (excess >= least) continue;
    least = excess;
    flattest = static_cast<FaceId>(c / 3);
    if (std::isnan(excess)) break;
  }
  return flattest;
}

// `what` failed for lack of bits.
[[noreturn]] void throw_too_degenerate(const char* what, const EngineInput& input,
                                       const MetricOptions& options) {
  const FaceId face = flattest_face(input);
  throw_not_converged(ErrorCode::kIterationLimit,
                      std::string(what) + " with " +
                          std::to_string(options.bits == 0 ? kLargestBits : options.bits) +
                          " bits. The flattest triangle is face " + face_id(face) + ". " +
                          (options.bits == 0 ? "Remove nearly degenerate triangles from the mesh."
                                             : "Use precision=\"auto\" or more bits."),
                      ElementKind::kFace, {face});
}

// Says what a metric that did not converge reached.
[[noreturn]] void throw_not_reached(const ConformalMetric& metric, const MetricOptions& options) {
  const bool seconds = metric.end == NewtonEnd::kSeconds;
  const char* cure =
      seconds ? "Allow more seconds (max_seconds), or spread the curvature over more vertices."
      : metric.end == NewtonEnd::kIterations
          ? "Spread the curvature over more vertices, or remove nearly degenerate triangles."
      : options.bits != 0 ? "Use precision=\"auto\" or more bits."
                          : "Spread the curvature over more vertices.";
  throw_not_converged(seconds ? ErrorCode::kTimeLimit : ErrorCode::kIterationLimit,
                      "The conformal metric was not reached: the largest angle error is " +
                          number_text(metric.angle_error) + " radians after " +
                          std::to_string(metric.iterations) + " Newton steps with " +
                          std::to_string(metric.bits) + " bits (stopped by " + name_of(metric.end) +
                          "). " + cure);
}

// The rungs of the precision ladder: Newton in double, and from where rounding decides, with ever
// more bits.
class Ladder {
 public:
  Ladder(const EngineInput& input, const MetricOptions& options, ExecutionContext& context)
      : input_(input), options_(options), context_(context), limit_(options.max_seconds) {
    newton_.tolerance = options.tolerance;
    newton_.pinned = input.pinned;
    if (input.pinned != nullptr) system_ = NewtonSystem(*input.pinned);
  }

  ConformalMetric climb() {
    bool replayed = false;
    // In double also before a given precision: it takes most of the way at a fraction of the cost.
    int bits = 53;
    for (;;) {
      const NewtonRun run = take_rung(bits);
      // A long way there and back is replaced by the direct one, for the sake of what replays the
      // flips: the same scale factors from the start again, which the uniqueness of the Delaunay
      // triangulation allows, then Newton to remove what rounding left.
      const bool enough_bits = options_.bits == 0 || bits == options_.bits;
      if (enough_bits && run.end == NewtonEnd::kConverged && !replayed && is_long_way()) {
        replayed = true;
        continue;
      }
      const bool more_bits_help =
          run.end == NewtonEnd::kPrecision && options_.bits == 0 && bits < kLargestBits;
      const bool out_of_time = run.end == NewtonEnd::kIterations || run.end == NewtonEnd::kSeconds;
      if (out_of_time || (enough_bits && !more_bits_help)) return finished(run);
      bits = options_.bits != 0 ? options_.bits
             : bits == 53       ? 128
                                : std::min(2 * bits, kLargestBits);
    }
  }

 private:
  // A fresh engine where the last one stands, and Newton from there. Where it does not get there,
  // the last one stays.
  NewtonRun take_rung(int bits) {
    ++rungs_;
    const double seconds = limit_ > 0.0 ? std::max(1e-3, limit_ - watch_.seconds()) : 0.0;
    newton_.max_iterations = options_.max_iterations - result_.iterations;
    newton_.earlier_tests = exact_tests_;
    newton_.more_bits = options_.bits == 0 ? bits < kLargestBits : bits < options_.bits;
    NewtonRun run;
    run.end = NewtonEnd::kPrecision;
    std::unique_ptr<MetricEngine> reached;  // what a replay is to improve on
    const bool in_time = ended_in_time([&] {
      const TimeLimit limit(context_, limit_of(seconds));
      std::unique_ptr<MetricEngine> fresh = make_engine(input_, bits, context_);
      if (!fresh->started()) {
        run.reason = "start not Delaunay";
      } else if (engine_ != nullptr && !fresh->go_to(engine_->scaled_so_far(context_), context_)) {
        run.reason = "scale factors out of range";
      } else {
        std::swap(engine_, fresh);
        if (last_.end == NewtonEnd::kConverged) reached = std::move(fresh);
        fresh.reset();
      }
      if (fresh != nullptr) exact_tests_ += fresh->exact_tests();
    });
    if (!in_time) {
      if (!(seconds > 0.0)) throw TimeIsOver();
      run.end = NewtonEnd::kSeconds;
      run.reason = "time was over at the start";
    }
    if (run.reason[0] == '\0') {
      newton_.max_seconds = seconds > 0.0 ? std::max(1e-3, limit_ - watch_.seconds()) : 0.0;
      run = run_newton(*engine_, system_, newton_, descent_, context_);
      if (run.end == NewtonEnd::kConverged && !engine_->has_triangles()) {
        run.end = NewtonEnd::kPrecision;
        run.reason = "a triangle's sides have lost it";
      }
      add(run);
      exact_tests_ += engine_->exact_tests();
      if (reached != nullptr && run.end == NewtonEnd::kSeconds) {
        engine_ = std::move(reached);
      } else {
        last_ = run;
      }
    }
    if (run.end == NewtonEnd::kPrecision && rungs_ == 1)
      result_.stats["climbed_because"] = std::string(run.reason);
    return run;
  }

  // The first of its errors repeats the last of the rung before; those of angles that were no
  // numbers are none.
  void add(const NewtonRun& run) {
    result_.iterations += run.iterations;
    evaluations_ += run.evaluations;
    relaxed_ += run.relaxed_iterations;
    bool repeated = !result_.error_history.empty();
    for (const double error : run.error_history) {
      if (!repeated && std::isfinite(error)) result_.error_history.push_back(error);
      repeated = false;
    }
  }

  bool is_long_way() const {
    const std::size_t direct = engine_->flips().size() - engine_->euclidean_flips();
    return direct > kLongWay * engine_->mesh().edge_count();
  }

  // `run`: the last one, which may not have got as far as Newton.
  ConformalMetric finished(const NewtonRun& run) {
    if (engine_ == nullptr && run.end == NewtonEnd::kSeconds)
      throw_out_of_time("The intrinsic Delaunay triangulation of the input was not reached",
                        options_.max_seconds, "or remove nearly degenerate triangles");
    if (engine_ == nullptr)
      throw_too_degenerate("The intrinsic Delaunay triangulation of the input was not reached",
                           input_, options_);
    // Where a replay had no time, the long way has led to the metric as well.
    const bool reached = last_.end == NewtonEnd::kConverged;
    measure(reached ? last_ : run);
    result_.stats["seconds"] = watch_.seconds();
    result_.stats["precision_rungs"] = std::int64_t{rungs_};
    result_.stats["evaluations"] = std::int64_t{evaluations_};
    result_.stats["relaxed_iterations"] = std::int64_t{relaxed_};
    result_.stats["intrinsic_refinement"] = std::int64_t{0};
    if (!std::isfinite(result_.angle_error) || !intrinsic::are_lengths(result_.length)) {
      if (run.end == NewtonEnd::kSeconds)
        throw_out_of_time("No metric with angles in the range of numbers was reached",
                          options_.max_seconds, "or remove nearly degenerate triangles");
      throw_too_degenerate("The angles of the metric could not be measured", input_, options_);
    }
    if (!result_.converged && options_.require_convergence) throw_not_reached(result_, options_);
    return std::move(result_);
  }

  // The metric where this run ended, its true angles and why it ended there. A metric that was
  // reached is worth kFinishing seconds more than there are; for want of time doubles are enough.
  void measure(const NewtonRun& run) {
    const double seconds = std::max(kFinishing, context_.seconds_left());
    const Grace finishing(context_);
    const TimeLimit limit(context_, seconds);
    result_.converged = run.end == NewtonEnd::kConverged;
    engine_->finish(result_, result_.converged, context_);
    Gradient gradient;
    // Sums of thousands of angles at one cone are off by 1e-10 in doubles, whatever was reached.
    const bool in_time = result_.converged || run.end == NewtonEnd::kPrecision;
    const bool fine = in_time && options_.tolerance < kFineAngles;
    engine_->evaluate(fine ? options_.tolerance : kFineAngles, gradient, context_);
    result_.angle_error = gradient.max_error;
    result_.angles = input_.target;
    for (std::size_t v = 0; v < gradient.value.size(); ++v) result_.angles[v] -= gradient.value[v];
    result_.stats["noise"] = run.noise;
    result_.end = run.end;
    result_.stats["stopped_by"] = std::string(name_of(run.end));
  }

  const EngineInput& input_;
  const MetricOptions& options_;
  ExecutionContext& context_;
  const Stopwatch watch_;
  const double limit_;
  ConformalMetric result_;
  std::unique_ptr<MetricEngine> engine_;  // the last one that got to its place
  NewtonRun last_;                        // its run
  NewtonSystem system_;
  NewtonOptions newton_;
  Descent descent_ = Descent::kUnknown;
  // Sums over the rungs.
  std::size_t exact_tests_ = 0;
  int rungs_ = 0, evaluations_ = 0, relaxed_ = 0;
};

}  // namespace

ConformalMetric compute_conformal_metric(const mesh::Surface& surface,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context,
                                         const Points3* lengths) {
  EngineInput input = checked_input(surface, lengths, options);
  input.target = checked_targets(target_angles, input, options.tolerance);
  ConformalMetric metric = Ladder(input, options, context).climb();
  debug_check("compute_conformal_metric", [&] { return find_broken_invariant(metric); });
  return metric;
}

ConformalMetric compute_pinned_metric(const mesh::Surface& surface,
                                      const std::vector<double>& target,
                                      const std::vector<char>& pinned, double tolerance,
                                      ExecutionContext& context) {
  EngineInput input = input_of(surface);
  input.target = target;
  input.pinned = &pinned;
  for (std::size_t v = 0; v < target.size(); ++v) {
    if (pinned[v]) input.target[v] = 0.0;
  }
  MetricOptions options;
  options.tolerance = tolerance;
  options.max_iterations = kMostPinnedSteps;
  options.require_convergence = false;
  ConformalMetric metric = Ladder(input, options, context).climb();
  metric.angle_error = 0.0;
  for (std::size_t v = 0; v < target.size(); ++v) {
    if (pinned[v]) continue;
    metric.angle_error = std::max(metric.angle_error, std::abs(metric.angles[v] - target[v]));
    metric.angles[v] = target[v];
  }
  return metric;
}

namespace {

constexpr int kMostRefinedSteps = 150;  // of Newton's method: if it helps, it helps soon
constexpr double kLeastSeconds = 1e-3;  // what a run that has no time left is given
constexpr double kFirstShare = 0.6;     // of the seconds, for the first of two ways

// Vertices added at most: per vertex of the input, but this many are always allowed, and never
// more than that.
constexpr std::int64_t kMostGrowth = 30;
constexpr std::int64_t kMostAnyway = 1000;
constexpr std::int64_t kMostEver = 5'000'000;

// The metric of the surface with points added where its intrinsic Delaunay triangulation is bad, as
// far as it is reached; `split` is null where it is not bad, or cannot be split.
RefinedMetric from_refined_start(const mesh::Surface& surface, const Points3* lengths,
                                 const std::vector<double>& target_angles,
                                 const MetricOptions& options, ExecutionContext& context) {
  const Stopwatch watch;
  RefinedMetric result;
  const auto vertices = static_cast<Index>(surface.vertices.rows());
  const Points3 sides =
      lengths != nullptr ? *lengths : intrinsic::lengths_of(surface.vertices, surface.faces);
  // Edges that doubles cannot tell from points: there is nothing to work with.
  if (!sides.allFinite() || !(sides.minCoeff() > 0.0)) return result;
  const intrinsic::FlatSurface flat = intrinsic::make_flat_surface(vertices, surface.faces, sides);
  intrinsic::RefinementOptions refinement;
  refinement.max_added =
      static_cast<Index>(std::clamp<std::int64_t>(kMostGrowth * vertices, kMostAnyway, kMostEver));
  const auto found = intrinsic::find_refinement_points(flat, refinement, context);
  auto split = std::make_unique<intrinsic::SplitSurface>();
  if (found.points.empty() || !intrinsic::split_surface(flat, found.points, context, *split))
    return result;
  const double seconds = watch.seconds();
  MetricOptions share = options;
  share.max_seconds = kFirstShare * options.max_seconds;
  share.max_iterations = std::min(options.max_iterations, kMostRefinedSteps);
  share.require_convergence = false;
  std::vector<double> targets = target_angles;
  for (const char boundary : split->added_on_boundary) targets.push_back(boundary ? pi : 2 * pi);
  result.metric = compute_conformal_metric({Points3::Zero(split->vertex_count, 3), split->faces},
                                           targets, share, context, &split->lengths);
  result.metric.added = split->added;
  Stats& stats = result.metric.stats;
  stats["smallest_start_angle"] = found.smallest_angle;
  stats["refinement_complete"] = static_cast<std::int64_t>(found.complete);
  stats["seconds_refinement"] = seconds;
  stats["intrinsic_refinement"] = static_cast<std::int64_t>(split->added.size());
  result.split = std::move(split);
  return result;
}

}  // namespace

RefinedMetric compute_refined_metric(const mesh::Surface& surface, const Points3* lengths,
                                     const std::vector<double>& target_angles,
                                     const MetricOptions& options, bool refine,
                                     ExecutionContext& context) {
  const auto compute = [&] {
    const Stopwatch watch;
    MetricOptions plain = options;
    std::optional<double> reached;
    if (refine) {
      checked_targets(target_angles, checked_input(surface, lengths, options), options.tolerance);
      context.report("refined start", 0.0);
      // Where not even its start is possible the plain way is left.
      Outcome<RefinedMetric> refined = attempt(
          [&] { return from_refined_start(surface, lengths, target_angles, options, context); });
      if (refined && refined->metric.converged) return std::move(*refined);
      if (refined && refined->split != nullptr) reached = refined->metric.angle_error;
      if (options.max_seconds > 0.0)
        plain.max_seconds = std::max(kLeastSeconds, options.max_seconds - watch.seconds());
    }
    RefinedMetric result;
    result.metric = compute_conformal_metric(surface, target_angles, plain, context, lengths);
    if (reached) result.metric.stats["refined_start_error"] = *reached;
    return result;
  };
  return in_time(context, options.max_seconds, "The conformal metric was not reached",
                 "or spread the curvature over more vertices", compute);
}

}  // namespace flipfree::conformal
