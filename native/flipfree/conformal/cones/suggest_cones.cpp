#include "flipfree/conformal/cones/suggest_cones.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/give_up.h"
#include "flipfree/base/failure/in_time.h"
#include "flipfree/base/stats.h"
#include "flipfree/conformal/cones/boundary_angles.h"
#include "flipfree/conformal/cones/cone_placement.h"
#include "flipfree/conformal/cones/cone_rounding.h"
#include "flipfree/conformal/metric/metric.h"
#include "flipfree/conformal/metric/pinned_metric.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::conformal {
namespace {

using std::numbers::pi;

constexpr double kPinnedTolerance = 1e-10;
// Metrics until the true scale factors, not only the linear ones, stay within the bound.
constexpr int kTrueRounds = 40;
// A metric with pinned cones that stopped short of its tolerance still shows where the next goes.
constexpr double kUsableError = 1e-6;
// Radians: rounding of the curvatures, and of target angles that came from a metric, to be spread.
constexpr double kQuantumSpread = 1e-6;
constexpr double kSpread = 1e-5;
constexpr double kCheckTolerance = 1e-8;  // of the metric that only measures the scale
constexpr double kStartAccuracy = 1e-12;
constexpr double kFlat = 1e-9;  // radians: vertices nearer to 2 pi are no cones
constexpr double kRelativeSlack = 1e-9;
// Rounded cones need more of them: shares of the bound's logarithm to which the linear problem is
// tightened, one after the other, until the rounded ones keep the bound.
constexpr std::array<double, 3> kTighter{0.7, 0.5, 0.35};

void check_options(const SuggestConesOptions& options) {
  if (!(options.bound > 1.0)) {
    throw_invalid(ErrorCode::kBadOption,
                  "bound must be larger than 1, not " + std::to_string(options.bound) + ".");
  }
  if (options.max_cones < 1) throw_invalid(ErrorCode::kBadOption, "max_cones must be at least 1.");
  if (!(options.quantum >= 0.0) || !(options.least_angle > 0.0) ||
      !(options.least_angle < 2 * pi)) {
    throw_invalid(ErrorCode::kBadOption,
                  "quantum must not be negative, least_angle must lie in (0, 2 pi).");
  }
}

double range_of(const std::vector<double>& u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  return *high - *low;
}

// Of a range of logarithms; finite.
double ratio_of(double range) {
  return std::min(std::exp(range), std::numeric_limits<double>::max());
}

VertexId extreme_of(const std::vector<double>& u, const std::vector<char>& pinned) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  const double middle = 0.5 * (*low + *high);
  VertexId best = kInvalid;
  double most = -1.0;
  for (std::size_t v = 0; v < u.size(); ++v) {
    if (pinned[v] || !(std::abs(u[v] - middle) > most)) continue;
    most = std::abs(u[v] - middle);
    best = static_cast<VertexId>(v);
  }
  return best;
}

// The surface as all steps see it.
struct Problem {
  const mesh::Surface& surface;
  const SuggestConesOptions& options;
  std::vector<bool> on_boundary;
  std::vector<double> flat;  // target angles without cones
  bool closed = true;
  Index euler = 0;
  double allowed = 0.0;  // range of u
  Stopwatch watch = {};

  bool is_limited() const { return options.max_seconds > 0.0 || options.enough_seconds > 0.0; }
  // Seconds of a TimeLimit from where there are cones on.
  double enough_left() const {
    return options.enough_seconds > 0.0 ? std::max(0.0, options.enough_seconds - watch.seconds())
                                        : limit_of(0.0);
  }
};

Problem make_problem(const mesh::Surface& surface, const SuggestConesOptions& options,
                     const std::vector<bool>& on_boundary) {
  const auto count = static_cast<Index>(surface.vertices.rows());
  Problem p{surface, options, on_boundary, std::vector<double>(at(count)), true, 0, 0.0};
  for (std::size_t v = 0; v < p.flat.size(); ++v) {
    p.flat[v] = on_boundary[v] ? pi : 2 * pi;
    p.closed = p.closed && !on_boundary[v];
  }
  p.euler = mesh::topology(surface.faces, mesh::build_adjacency(count, surface.faces)).euler();
  p.allowed = std::log(options.bound);
  return p;
}

// Cones until the linear problem keeps the range and no cone is too sharp.
void place_linearly(const Problem& p, double allowed, LinearPlacement& linear,
                    std::vector<VertexId>& cones, ExecutionContext& context) {
  const double most_curvature = 2 * pi - p.options.least_angle;
  const auto too_sharp = [&] {
    return (linear.charge.size() > 0 && linear.charge.maxCoeff() > most_curvature) ||
           (p.closed && linear.base_charge() > most_curvature);
  };
  while (static_cast<Index>(cones.size()) < p.options.max_cones &&
         (linear.range() > allowed || too_sharp())) {
    const VertexId v = linear.extreme();
    if (v == kInvalid) break;
    linear.add(v, context);
    cones.push_back(v);
    context.report("suggest cones", 0.5 * std::min(1.0, allowed / linear.range()));
  }
}

// Does the metric give its cones positive angles?
bool is_usable(const PinnedMetric& metric) {
  return !metric.angles.empty() && metric.error <= kUsableError &&
         std::all_of(metric.angles.begin(), metric.angles.end(),
                     [](double angle) { return angle > 0.0; });
}

// The true metric with u = 0 at the cones; more cones at its extremes until the bound holds.
PinnedMetric place_truly(const Problem& p, std::vector<char> pinned, std::vector<VertexId>& cones,
                         ExecutionContext& context) {
  for (const VertexId v : cones) pinned[at(v)] = 1;
  PinnedMetric metric;
  std::size_t measured = 0;  // cones of `metric`
  const bool in_time = ended_in_time([&] {
    for (int round = 0; round < kTrueRounds; ++round) {
      const TimeLimit enough(context, is_usable(metric) ? p.enough_left() : limit_of(0.0));
      context.report("suggest cones", 0.5 + 0.3 * round / kTrueRounds);
      metric = compute_pinned_metric(p.surface, p.flat, pinned, kPinnedTolerance, context);
      measured = cones.size();
      bool positive = true;
      for (const double angle : metric.angles)
        positive = positive && angle >= p.options.least_angle;
      const bool usable = metric.converged || metric.error < kUsableError;
      if (usable && positive && range_of(metric.u) <= p.allowed) break;
      if (static_cast<Index>(cones.size()) >= p.options.max_cones) break;
      const VertexId v = extreme_of(metric.u, pinned);
      if (v == kInvalid) break;
      pinned[at(v)] = 1;
      cones.push_back(v);
    }
  });
  if (!in_time) {
    // Cones whose angles are positive serve, though the bound does not hold.
    if (!p.is_limited() || !is_usable(metric)) throw TimeIsOver();
    cones.resize(measured);
  }
  for (std::size_t v = 0; v < metric.angles.size(); ++v) {
    if (!(metric.angles[v] > 0.0) || !(metric.error <= kUsableError)) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "No cones with positive angles were found with at most " +
                              std::to_string(p.options.max_cones) +
                              " cones. Allow more cones (max_cones).",
                          ElementKind::kVertex, {static_cast<Index>(v)});
    }
  }
  return metric;
}

struct MeasuredCones {
  std::vector<double> target_angles;  // the boundary's as they come out
  TrueScale scale;
};

// The true metric of cones with curvatures in quanta. A free boundary takes what they leave.
MeasuredCones measure(const Problem& p, const ConeSteps& cones, ExecutionContext& context) {
  MeasuredCones out;
  out.target_angles = p.flat;
  for (const auto& [v, steps] : cones) out.target_angles[at(v)] -= steps * p.options.quantum;
  if (p.closed) {
    close_gauss_bonnet(out.target_angles, p.on_boundary, p.euler, kQuantumSpread);
    MetricOptions check;
    check.tolerance = kCheckTolerance;
    check.require_convergence = false;
    const auto reached = compute_conformal_metric(p.surface, out.target_angles, check, context);
    if (reached.converged) out.scale = {reached.scale_factors, reached.scale_range};
  } else {
    const std::vector<char> boundary(p.on_boundary.begin(), p.on_boundary.end());
    auto metric =
        compute_pinned_metric(p.surface, out.target_angles, boundary, kPinnedTolerance, context);
    if (metric.error < kUsableError) {
      out.target_angles = metric.angles;
      out.scale.range = range_of(metric.u);
      out.scale.u = std::move(metric.u);
    }
  }
  return out;
}

// Angles that the linear problem gives its cones.
std::vector<double> linear_angles(const Problem& p, const LinearPlacement& linear, VertexId base) {
  std::vector<double> angles = p.flat;
  if (p.closed) angles[at(base)] -= linear.base_charge();
  for (std::size_t i = 0; i < linear.cones.size(); ++i)
    angles[at(linear.cones[i])] -= linear.charge[static_cast<Eigen::Index>(i)];
  return angles;
}

// Replaces cones of any curvature by ones of whole quanta. Where their scale leaves the bound, it
// is tried again from more cones than free curvatures need.
void quantise(const Problem& p, LinearPlacement& linear, SuggestedCones& out,
              ExecutionContext& context) {
  ConeSearch search;
  search.quantum = p.options.quantum;
  search.most_steps = static_cast<int>(std::ceil(2 * pi / search.quantum - kRelativeSlack)) - 1;
  search.balanced = p.closed;
  search.allowed = p.allowed;
  search.max_cones = p.options.max_cones;
  search.fixed.assign(p.on_boundary.begin(), p.on_boundary.end());
  // What was measured best: it is the result also where time is over in the search for better.
  MeasuredCones best_measured;
  FoundCones best{{}, std::numeric_limits<double>::infinity()};
  std::optional<TimeLimit> enough;  // from the first ones on
  const auto scale_of = [&](const ConeSteps& cones) {
    // Other cones may have a metric, or can take the curvature in whole quanta.
    Outcome<MeasuredCones> measured = attempt_part([&] { return measure(p, cones, context); });
    if (!measured) return TrueScale{};
    TrueScale scale = measured->scale;
    if (!scale.u.empty() && scale.range < best.range) {
      best = {cones, scale.range};
      best_measured = std::move(*measured);
      if (!enough) enough.emplace(context, p.enough_left());
    }
    return scale;
  };
  std::vector<double> angles = out.target_angles;
  std::vector<VertexId> cones = out.cones;
  const bool in_time = ended_in_time([&] {
    for (std::size_t i = 0; i <= kTighter.size(); ++i) {
      const double part = 0.2 / static_cast<double>(kTighter.size() + 1);
      const ProgressRange range(context, 0.8 + part * static_cast<double>(i),
                                0.8 + part * static_cast<double>(i + 1));
      search_cones(p.surface, linear, search,
                   round_cones(p.surface, angles, cones, search.quantum, search.most_steps),
                   scale_of, context);
      if (best.range <= p.allowed || i == kTighter.size()) break;
      cones.assign(out.cones.begin(), out.cones.begin() + (p.closed ? 1 : 0));
      cones.insert(cones.end(), linear.cones.begin(), linear.cones.end());
      place_linearly(p, kTighter[i] * p.allowed, linear, cones, context);
      angles = linear_angles(p, linear, cones.front());
    }
  });
  enough.reset();
  if (!in_time && (!p.is_limited() || best_measured.scale.u.empty())) throw TimeIsOver();
  if (best_measured.scale.u.empty() && !p.closed) best_measured = measure(p, {}, context);
  if (best_measured.scale.u.empty()) {
    throw_not_converged(ErrorCode::kIterationLimit,
                        "The metric of the rounded cones was not reached. Use a finer mesh without "
                        "nearly degenerate triangles, or cones of any angle "
                        "(quarter_turns=False).");
  }
  out.target_angles = std::move(best_measured.target_angles);
  out.scale_ratio = ratio_of(best_measured.scale.range);
  out.cones.clear();
  for (const auto& [v, steps] : best.cones) out.cones.push_back(v);
}

}  // namespace

namespace {

// As suggest_cones, within the limit of `context`.
SuggestedCones cones_in_time(const mesh::Surface& surface, const SuggestConesOptions& options,
                             ExecutionContext& context) {
  check_options(options);
  mesh::ValidateOptions rules;
  rules.require_connected = true;
  rules.allow_isolated_vertices = false;
  mesh::validate(surface, rules, context);

  EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  const Problem p = make_problem(surface, options, input.setup.on_boundary);
  input.target = p.flat;

  SuggestedCones out;
  context.report("suggest cones", 0.0);
  const auto engine = make_double_engine(input, context);
  Gradient gradient;
  engine->evaluate(kStartAccuracy, gradient, context);
  std::vector<char> pinned(p.on_boundary.begin(), p.on_boundary.end());
  // A closed surface needs one vertex to measure u against: the most curved one, which is the first
  // cone.
  if (p.closed) {
    const auto sharpest = std::max_element(gradient.value.begin(), gradient.value.end());
    const auto first = static_cast<VertexId>(sharpest - gradient.value.begin());
    pinned[at(first)] = 1;
    out.cones.push_back(first);
  }
  LinearPlacement linear(engine->mesh(), gradient, pinned, context);
  place_linearly(p, p.allowed, linear, out.cones, context);
  const PinnedMetric metric = place_truly(p, std::move(pinned), out.cones, context);
  out.target_angles = metric.angles;
  out.scale_ratio = ratio_of(range_of(metric.u));
  if (options.quantum > 0.0) quantise(p, linear, out, context);
  close_measured_angles(out.target_angles, p.on_boundary, p.euler, kSpread);
  std::erase_if(out.cones,
                [&](VertexId v) { return std::abs(out.target_angles[at(v)] - 2 * pi) < kFlat; });
  out.bound_holds = out.scale_ratio <= options.bound * (1.0 + kRelativeSlack);
  return out;
}

}  // namespace

SuggestedCones suggest_cones(const mesh::Surface& surface, const SuggestConesOptions& options,
                             ExecutionContext& context) {
  return in_time(context, options.max_seconds, "No cones were found", "or allow a larger bound",
                 [&] { return cones_in_time(surface, options, context); });
}

}  // namespace flipfree::conformal
