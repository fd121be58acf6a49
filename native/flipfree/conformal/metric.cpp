#include "flipfree/conformal/metric.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/conformal/engine.h"
#include "flipfree/conformal/newton.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::conformal {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kLargestBits = 4096;
// Flips per edge from which on a direct way is worth its search: an overlay replays a flip in some
// 50 ns, while the search costs about a microsecond per edge.
constexpr std::size_t kLongWay = 4;

std::string text(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof(buffer), "%.6g", value);
  return buffer;
}

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

// Positive, finite, one per vertex, and meeting Gauss-Bonnet: the angles of #F triangles sum to pi
// #F. What rounding leaves of the remainder is spread evenly. Returns the targets to solve for.
std::vector<double> checked_targets(const std::vector<double>& target, const IntrinsicSetup& setup,
                                    Index vertex_count, Index face_count, Index euler,
                                    double tolerance) {
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
    const Index first = bad.front();
    if (bad.size() > 1000) bad.resize(1000);
    throw_invalid(
        ErrorCode::kBadAngles,
        "The target angle of vertex " + std::to_string(first) +
            " is not a positive number. Every angle must be greater than 0 (flat interior is 2 pi, "
            "straight boundary pi).",
        ElementKind::kVertex, std::move(bad));
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
                     "The prescribed curvatures sum to " + text(static_cast<double>(curvature)) +
                         ", but 2 pi times the Euler "
                         "characteristic " +
                         std::to_string(euler) + " is " + text(2.0 * kPi * euler) +
                         " (Gauss-Bonnet). Add " + text(static_cast<double>(missing)) +
                         " radians (" + text(static_cast<double>(missing) / (0.5 * kPi)) +
                         " quarter turns) to the sum of the target angles.",
                     {"angle sum",
                      {{"sum", {static_cast<double>(sum)}},
                       {"needed", {std::numbers::pi * static_cast<double>(face_count)}}}});
  }
  std::vector<double> spread = target;
  for (double& t : spread) t += share;
  return spread;
}

void check_topology(const std::vector<Error>& defects) {
  if (!defects.empty()) throw InvalidInput(defects.front());
}

// Lengths per edge from lengths per corner; both sides must agree and every face be a proper
// triangle.
std::vector<double> edge_lengths(const IntrinsicSetup& setup, const Points3& lengths) {
  std::vector<double> result(setup.mesh.edge_count(), 0.0);
  for (Eigen::Index f = 0; f < lengths.rows(); ++f) {
    const auto l = lengths.row(f);
    const bool proper = l.allFinite() && l.minCoeff() > 0.0 && l[0] + l[1] > l[2] &&
                        l[1] + l[2] > l[0] && l[2] + l[0] > l[1];
    if (!proper) {
      throw_invalid(ErrorCode::kZeroAreaFace,
                    "The lengths of face " + std::to_string(f) + " (" + text(l[0]) + ", " +
                        text(l[1]) + ", " + text(l[2]) +
                        ") do not satisfy the strict triangle inequality. Correct them.",
                    ElementKind::kFace, {static_cast<Index>(f)});
    }
    for (int k = 0; k < 3; ++k) {
      const HalfedgeId h = setup.input_halfedge[static_cast<std::size_t>(3 * f + k)];
      double& stored = result[static_cast<std::size_t>(h >> 1)];
      if (stored != 0.0 && std::abs(stored - l[k]) > 1e-12 * stored) {
        throw_invalid(ErrorCode::kBadShape,
                      "The two faces at the edge from corner " + std::to_string(k) + " of face " +
                          std::to_string(f) + " give it different lengths, " + text(stored) +
                          " and " + text(l[k]) + ". Make them equal.",
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

Index euler_characteristic(const IntrinsicSetup& setup, Index vertex_count, Index face_count) {
  const IntrinsicMesh& m = setup.mesh;
  Index edges = static_cast<Index>(m.edge_count());
  if (m.symmetric()) {
    edges =
        static_cast<Index>(std::count_if(m.edge_label.begin(), m.edge_label.end(),
                                         [](EdgeLabel label) { return label != EdgeLabel::kTwo; }));
  }
  return vertex_count - edges + face_count;
}

// Sums over the rungs of the precision ladder.
struct Totals {
  std::size_t exact_tests = 0;
  int rungs = 0;
  int evaluations = 0;
  int relaxed = 0;
  double seconds_start = 0.0;
  double seconds_flips = 0.0;
  double seconds_angles = 0.0;
  double seconds_relax = 0.0;
};

// Adds a run and its errors; the first of them repeats the last of the rung before.
void add_run(const NewtonRun& run, Totals& totals, ConformalMetric& result) {
  result.iterations += run.iterations;
  totals.evaluations += run.evaluations;
  totals.relaxed += run.relaxed_iterations;
  totals.seconds_flips += run.seconds_flips;
  totals.seconds_angles += run.seconds_angles;
  totals.seconds_relax += run.seconds_relax;
  const bool repeated = totals.rungs > 1 && !run.error_history.empty();
  result.error_history.insert(result.error_history.end(),
                              run.error_history.begin() + (repeated ? 1 : 0),
                              run.error_history.end());
}

void write_stats(const Totals& totals, const NewtonSystem& system, Stats& stats) {
  stats["seconds_start"] = totals.seconds_start;
  stats["seconds_flips"] = totals.seconds_flips;
  stats["seconds_angles"] = totals.seconds_angles;
  stats["seconds_relax"] = totals.seconds_relax;
  stats["seconds_symbolic"] = system.seconds_symbolic();
  stats["seconds_direction"] = system.seconds_numeric();
  stats["precision_rungs"] = static_cast<std::int64_t>(totals.rungs);
  stats["evaluations"] = static_cast<std::int64_t>(totals.evaluations);
  stats["factorizations"] = static_cast<std::int64_t>(system.factorizations());
  stats["old_factor_solves"] = static_cast<std::int64_t>(system.old_factor_solves());
  stats["accurate_factorizations"] = static_cast<std::int64_t>(system.accurate_factorizations());
  stats["relaxed_iterations"] = static_cast<std::int64_t>(totals.relaxed);
  stats["orderings"] = static_cast<std::int64_t>(system.orderings());
  stats["symbolic_analyses"] = static_cast<std::int64_t>(system.analyses());
  stats["exact_delaunay_tests"] = static_cast<std::int64_t>(totals.exact_tests);
  stats["intrinsic_refinement"] = static_cast<std::int64_t>(0);
}

// The metric where the last run ended, its true angles and why it ended there.
void finish_result(MetricEngine& engine, const EngineInput& input, const MetricOptions& options,
                   const NewtonRun& run, ConformalMetric& result, ExecutionContext& context) {
  result.converged = run.end == NewtonEnd::kConverged;
  engine.finish(result);
  Gradient gradient;
  engine.evaluate(options.tolerance < 1e-13 ? options.tolerance : 1e-13, gradient, context);
  result.angle_error = gradient.max_error;
  result.angles.resize(input.target.size());
  for (std::size_t v = 0; v < input.target.size(); ++v)
    result.angles[v] = input.target[v] - gradient.value[v];
  result.stats["noise"] = run.noise;
  result.stats["stopped_by"] = std::string(run.end == NewtonEnd::kConverged    ? "tolerance"
                                           : run.end == NewtonEnd::kPrecision  ? "precision"
                                           : run.end == NewtonEnd::kIterations ? "iterations"
                                                                               : "seconds");
}

[[noreturn]] void throw_not_started(const MetricOptions& options) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      "The intrinsic Delaunay triangulation of the input was not reached with " +
                          std::to_string(options.bits == 0 ? kLargestBits : options.bits) +
                          " bits. " +
                          (options.bits == 0 ? "Remove nearly degenerate triangles from the mesh."
                                             : "Use precision=\"auto\" or more bits."));
}

// The precision ladder: Newton in double, and from where rounding decides, with ever more bits.
ConformalMetric climb(const EngineInput& input, const MetricOptions& options,
                      ExecutionContext& context) {
  const Stopwatch watch;
  ConformalMetric result;
  ScaleLogarithms scale;
  NewtonSystem system;
  NewtonOptions newton;
  Descent descent = Descent::kUnknown;
  newton.tolerance = options.tolerance;
  int bits =
      53;  // also before a given precision: it takes most of the way at a fraction of the cost
  Totals totals;
  bool replayed = false;
  double limit = options.max_seconds;
  auto more_seconds = options.more_seconds;
  for (;;) {
    ++totals.rungs;
    newton.max_iterations = options.max_iterations - result.iterations;
    newton.max_seconds = limit > 0.0 ? std::max(1e-3, limit - watch.seconds()) : 0.0;
    newton.more_bits = options.bits == 0 ? bits < kLargestBits : bits < options.bits;
    const Stopwatch starting;
    const std::unique_ptr<MetricEngine> engine = make_engine(input, bits, context);
    const bool started = engine->started();
    bool reached = started;
    if (started && !scale.empty()) reached = engine->go_to(scale, context);
    totals.seconds_start += starting.seconds();
    NewtonRun run;
    if (reached) {
      run = run_newton(*engine, system, newton, descent, context);
      add_run(run, totals, result);
    } else {
      run.end = NewtonEnd::kPrecision;
      run.reason = started ? "scale factors out of range" : "start not Delaunay";
      run.error = std::numeric_limits<double>::infinity();
    }
    totals.exact_tests += engine->exact_tests();
    if (run.end == NewtonEnd::kPrecision && totals.rungs == 1)
      result.stats["climbed_because"] = std::string(run.reason);
    // A long way there and back is replaced by the direct one, for the sake of what replays the
    // flips: the same scale factors from the start again, which the uniqueness of the Delaunay
    // triangulation allows, then Newton to remove what rounding left.
    const bool enough_bits = options.bits == 0 || bits == options.bits;
    const std::size_t direct = engine->flips().size() - engine->euclidean_flips();
    if (enough_bits && run.end == NewtonEnd::kConverged && !replayed &&
        direct > kLongWay * engine->mesh().edge_count()) {
      replayed = true;
      scale = engine->scaled_so_far();
      continue;
    }
    if (run.end == NewtonEnd::kSeconds && more_seconds) {
      const double more = more_seconds();
      more_seconds = {};
      if (more > 0.0) {
        limit = watch.seconds() + more;
        if (reached) scale = engine->scaled_so_far();
        continue;
      }
    }
    const bool more_bits_help =
        run.end == NewtonEnd::kPrecision && options.bits == 0 && bits < kLargestBits;
    const bool out_of_time = run.end == NewtonEnd::kIterations || run.end == NewtonEnd::kSeconds;
    const bool last = out_of_time || (enough_bits && !more_bits_help);
    if (last) {
      if (!started) throw_not_started(options);
      finish_result(*engine, input, options, run, result, context);
      break;
    }
    if (reached) scale = engine->scaled_so_far();
    bits = options.bits != 0 ? options.bits : bits == 53 ? 128 : std::min(2 * bits, kLargestBits);
  }
  result.stats["seconds"] = watch.seconds();
  write_stats(totals, system, result.stats);
  if (!result.converged && options.require_convergence) throw_not_reached(result, options);
  return result;
}

ConformalMetric solve(EngineInput& input, const std::vector<double>& target_angles,
                      Index face_count, const MetricOptions& options, ExecutionContext& context) {
  const Index euler = euler_characteristic(input.setup, input.vertex_count, face_count);
  input.target = checked_targets(target_angles, input.setup, input.vertex_count, face_count, euler,
                                 options.tolerance);
  return climb(input, options, context);
}

// What both ways in check and make.
EngineInput checked_input(const Surface& surface, const MetricOptions& options) {
  check_options(options);
  ValidateOptions rules;
  rules.require_connected = true;
  rules.allow_isolated_vertices = false;
  check_topology(find_defects(surface, rules));
  EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  return input;
}

EngineInput checked_input(Index vertex_count, const Triangles& faces, const Points3& lengths,
                          const MetricOptions& options) {
  check_options(options);
  if (lengths.rows() != faces.rows()) {
    throw_invalid(ErrorCode::kBadShape, "lengths must have one row per face.");
  }
  ValidateOptions rules;
  rules.require_connected = true;
  rules.allow_isolated_vertices = false;
  rules.reject_zero_area = false;
  check_topology(find_defects({Points3::Zero(vertex_count, 3), faces}, rules));
  EngineInput input;
  input.vertex_count = vertex_count;
  input.setup = build_intrinsic_mesh(vertex_count, faces);
  input.edge_length = edge_lengths(input.setup, lengths);
  return input;
}

}  // namespace

ConformalMetric compute_conformal_metric(const Surface& surface,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context) {
  EngineInput input = checked_input(surface, options);
  return solve(input, target_angles, static_cast<Index>(surface.faces.rows()), options, context);
}

ConformalMetric compute_conformal_metric(Index vertex_count, const Triangles& faces,
                                         const Points3& lengths,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context) {
  EngineInput input = checked_input(vertex_count, faces, lengths, options);
  return solve(input, target_angles, static_cast<Index>(faces.rows()), options, context);
}

void throw_not_reached(const ConformalMetric& metric, const MetricOptions& options) {
  const auto& stopped_by = std::get<std::string>(metric.stats.at("stopped_by"));
  const char* cure = stopped_by == "seconds"
                         ? "Allow more seconds, or spread the curvature over more vertices."
                     : stopped_by == "iterations"
                         ? "Allow more iterations, or spread the curvature over more vertices."
                     : options.bits != 0 ? "Use precision=\"auto\" or more bits."
                                         : "Spread the curvature over more vertices.";
  throw_not_converged(stopped_by == "seconds" ? ErrorCode::kTimeLimit : ErrorCode::kIterationLimit,
                      "The conformal metric was not reached: the largest angle error is " +
                          text(metric.angle_error) + " radians after " +
                          std::to_string(metric.iterations) + " Newton steps with " +
                          std::to_string(metric.bits) + " bits (stopped by " + stopped_by + "). " +
                          cure);
}

void validate_metric_input(const Surface& surface, const Points3* lengths,
                           const std::vector<double>& target_angles, const MetricOptions& options) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const auto face_count = static_cast<Index>(surface.faces.rows());
  const EngineInput input = lengths == nullptr
                                ? checked_input(surface, options)
                                : checked_input(vertex_count, surface.faces, *lengths, options);
  checked_targets(target_angles, input.setup, vertex_count, face_count,
                  euler_characteristic(input.setup, vertex_count, face_count), options.tolerance);
}

}  // namespace flipfree::conformal
