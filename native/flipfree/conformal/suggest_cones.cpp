#include "flipfree/conformal/suggest_cones.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/conformal/pinned_metric.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/mesh/validate.h"

namespace flipfree {
namespace {

using conformal::PinnedMetric;
using std::numbers::pi;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

constexpr double kPinnedTolerance = 1e-10;
constexpr int kTrueRounds = 40;

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

// The linear problem: -L u = K - sum of cone charges, u = 0 at base pins and cones. A charge is a
// cone's curvature.
class LinearPlacement {
 public:
  // `gradient`: evaluated at u = 0 with flat targets, so its value is the curvature K of the
  // surface.
  LinearPlacement(const conformal::IntrinsicMesh& mesh, const conformal::Gradient& gradient,
                  std::vector<char> base, ExecutionContext& context)
      : base_(std::move(base)), laplacian_(mesh, gradient, base_, context) {
    if (!laplacian_.valid()) {
      throw_not_converged(
          ErrorCode::kFactorizationFailed,
          "The Laplacian of the surface is not positive definite to working precision: its "
          "triangles are too degenerate. Remesh the surface.");
    }
    free_ = laplacian_.solve(gradient.value, context);
    for (double& x : free_) x = -x;
    total_ = 0.0;
    for (const double x : gradient.value) total_ += x;
    u = free_;
  }

  // Puts a cone at v and updates u and charge.
  void add(VertexId v, ExecutionContext& context) {
    std::vector<double> unit(free_.size(), 0.0);
    unit[at(v)] = 1.0;
    green_.push_back(laplacian_.solve(unit, context));
    cones.push_back(v);
    const auto k = static_cast<Eigen::Index>(cones.size());
    Eigen::MatrixXd a(k, k);
    Eigen::VectorXd b(k);
    for (Eigen::Index i = 0; i < k; ++i) {
      const std::size_t row = at(cones[static_cast<std::size_t>(i)]);
      b[i] = free_[row];
      for (Eigen::Index j = 0; j < k; ++j) a(i, j) = green_[static_cast<std::size_t>(j)][row];
    }
    charge = -a.ldlt().solve(b);
    u = free_;
    for (std::size_t j = 0; j < cones.size(); ++j) {
      const double q = charge[static_cast<Eigen::Index>(j)];
      for (std::size_t w = 0; w < u.size(); ++w) u[w] += q * green_[j][w];
    }
  }

  // The vertex that is neither pinned nor a cone with the largest |u|.
  VertexId extreme() const {
    VertexId best = kInvalid;
    double most = 0.0;
    for (std::size_t v = 0; v < u.size(); ++v) {
      if (base_[v] || !(std::abs(u[v]) > most)) continue;
      if (std::find(cones.begin(), cones.end(), static_cast<VertexId>(v)) != cones.end()) continue;
      most = std::abs(u[v]);
      best = static_cast<VertexId>(v);
    }
    return best;
  }

  double range() const {
    const auto [low, high] = std::minmax_element(u.begin(), u.end());
    return std::max(*high, 0.0) - std::min(*low, 0.0);
  }

  std::vector<double> u;
  std::vector<VertexId> cones;
  Eigen::VectorXd charge;
  double total_ = 0.0;

 private:
  std::vector<char> base_;
  conformal::PinnedLaplacian laplacian_;
  std::vector<double> free_;
  std::vector<std::vector<double>> green_;
};

double range_of(const std::vector<double>& u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  return *high - *low;
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

// Rounds curvatures of the cones to multiples of the quantum; angles stay positive. What rounding
// leaves at a cone goes to the next one on a shortest tree through all of them, leaves first:
// excess and lack then lie side by side, and a dipole is felt only near it, where an excess without
// a neighbour bends the scale of the whole surface. Cones that become flat are dropped.
void quantise(const Surface& surface, std::vector<double>& angles, std::vector<VertexId>& cones,
              double quantum) {
  const std::size_t count = cones.size();
  if (count == 0) return;
  // Prim's algorithm: every cone after the one it hangs on.
  std::vector<std::size_t> order{0};
  std::vector<std::size_t> parent(count, 0);
  std::vector<double> distance(count, std::numeric_limits<double>::infinity());
  std::vector<char> reached(count, 0);
  reached[0] = 1;
  while (order.size() < count) {
    const std::size_t last = order.back();
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (reached[i]) continue;
      const double d =
          (surface.vertices.row(cones[i]) - surface.vertices.row(cones[last])).squaredNorm();
      if (d < distance[i]) {
        distance[i] = d;
        parent[i] = last;
      }
      if (nearest == 0 || distance[i] < distance[nearest]) nearest = i;
    }
    reached[nearest] = 1;
    order.push_back(nearest);
  }
  const double most = std::ceil(2 * pi / quantum - 1e-9) - 1.0;
  std::vector<double> wanted(count);
  for (std::size_t i = 0; i < count; ++i) wanted[i] = (2 * pi - angles[at(cones[i])]) / quantum;
  std::vector<VertexId> kept;
  for (std::size_t k = count; k-- > 0;) {
    const std::size_t i = order[k];
    const double steps = std::min(std::round(wanted[i]), most);
    if (k > 0) wanted[parent[i]] += wanted[i] - steps;
    angles[at(cones[i])] = 2 * pi - steps * quantum;
    if (steps != 0.0) kept.push_back(cones[i]);
  }
  std::reverse(kept.begin(), kept.end());
  cones = kept;
}

}  // namespace

SuggestedCones suggest_cones(const Surface& surface, const SuggestConesOptions& options,
                             ExecutionContext& context) {
  check_options(options);
  ValidateOptions rules;
  rules.require_connected = true;
  rules.allow_isolated_vertices = false;
  validate(surface, rules, context);
  const auto count = static_cast<Index>(surface.vertices.rows());
  const Adjacency adjacency = build_adjacency(count, surface.faces);
  const Index euler = topology(surface.faces, adjacency).euler();

  conformal::EngineInput input;
  input.vertex_count = count;
  input.setup = conformal::build_intrinsic_mesh(count, surface.faces);
  input.positions = &surface.vertices;
  const std::vector<bool> on_boundary = input.setup.on_boundary;
  std::vector<double> flat(at(count));
  std::vector<char> pinned(at(count), 0);
  bool closed = true;
  for (std::size_t v = 0; v < flat.size(); ++v) {
    flat[v] = on_boundary[v] ? pi : 2 * pi;
    pinned[v] = on_boundary[v];
    closed = closed && !on_boundary[v];
  }
  input.target = flat;

  SuggestedCones out;
  context.report("suggest cones", 0.0);
  const auto engine = conformal::make_double_engine(input, context);
  conformal::Gradient gradient;
  engine->evaluate(1e-12, gradient, context);
  const double allowed = std::log(options.bound);
  const double most_curvature = 2 * pi - options.least_angle;
  // A closed surface needs one vertex to measure u against: the most curved one, which is the first
  // cone.
  if (closed) {
    const auto sharpest = std::max_element(gradient.value.begin(), gradient.value.end());
    const auto first = static_cast<VertexId>(sharpest - gradient.value.begin());
    pinned[at(first)] = 1;
    out.cones.push_back(first);
  }
  LinearPlacement linear(engine->mesh(), gradient, pinned, context);
  const auto too_sharp = [&] {
    double base = linear.total_;
    for (Eigen::Index i = 0; i < linear.charge.size(); ++i) {
      base -= linear.charge[i];
      if (linear.charge[i] > most_curvature) return true;
    }
    return closed && base > most_curvature;
  };
  while (static_cast<Index>(out.cones.size()) < options.max_cones &&
         (linear.range() > allowed || too_sharp())) {
    const VertexId v = linear.extreme();
    if (v == kInvalid) break;
    linear.add(v, context);
    out.cones.push_back(v);
    context.report("suggest cones", 0.5 * std::min(1.0, allowed / linear.range()));
  }

  // The true metric decides.
  for (const VertexId v : out.cones) pinned[at(v)] = 1;
  PinnedMetric metric;
  for (int round = 0; round < kTrueRounds; ++round) {
    context.report("suggest cones", 0.5 + 0.5 * round / kTrueRounds);
    metric = conformal::compute_pinned_metric(surface, flat, pinned, kPinnedTolerance, context);
    bool positive = true;
    for (std::size_t v = 0; v < flat.size(); ++v)
      positive = positive && metric.angles[v] >= options.least_angle;
    const bool usable = metric.converged || metric.error < 1e-6;
    if (usable && positive && range_of(metric.u) <= allowed) break;
    if (static_cast<Index>(out.cones.size()) >= options.max_cones) break;
    const VertexId v = extreme_of(metric.u, pinned);
    if (v == kInvalid) break;
    pinned[at(v)] = 1;
    out.cones.push_back(v);
  }
  out.target_angles = metric.angles;
  for (std::size_t v = 0; v < flat.size(); ++v) {
    if (!(out.target_angles[v] > 0.0) || !(metric.error <= 1e-6)) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "No cones with positive angles were found with at most " +
                              std::to_string(options.max_cones) +
                              " cones. Allow more cones (max_cones).",
                          ElementKind::kVertex, {static_cast<Index>(v)});
    }
  }
  out.scale_ratio = std::exp(range_of(metric.u));
  if (options.quantum > 0.0) {
    quantise(surface, out.target_angles, out.cones, options.quantum);
    if (closed) {
      close_gauss_bonnet(out.target_angles, on_boundary, euler, 1e-6);
      conformal::MetricOptions check;
      check.tolerance = 1e-8;
      const auto reached =
          conformal::compute_conformal_metric(surface, out.target_angles, check, context);
      out.scale_ratio = std::exp(reached.scale_range);
    } else {
      // The free boundary takes what the cones no longer have.
      std::vector<char> boundary(on_boundary.begin(), on_boundary.end());
      metric = conformal::compute_pinned_metric(surface, out.target_angles, boundary,
                                                kPinnedTolerance, context);
      out.target_angles = metric.angles;
      out.scale_ratio = std::exp(range_of(metric.u));
    }
  }
  close_gauss_bonnet(out.target_angles, on_boundary, euler, 1e-5);
  std::erase_if(out.cones,
                [&](VertexId v) { return std::abs(out.target_angles[at(v)] - 2 * pi) < 1e-9; });
  out.bound_holds = out.scale_ratio <= options.bound * (1.0 + 1e-9);
  return out;
}

}  // namespace flipfree
