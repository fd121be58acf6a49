#include "flipfree/conformal/suggest_cones.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/stats.h"
#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/conformal/newton_system.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::conformal {

namespace {

using std::numbers::pi;

struct Extremes {
  VertexId low = 0, high = 0;
  double middle = 0.0, range = 0.0;
};
Extremes extremes_of(const std::vector<double>& u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  return {static_cast<VertexId>(low - u.begin()), static_cast<VertexId>(high - u.begin()),
          0.5 * (*low + *high), *high - *low};
}

// The vertex not taken whose u is farthest from the middle; kInvalid if none is farther than this.
VertexId farthest(const std::vector<double>& u, const std::vector<char>& taken, double middle,
                  double most) {
  VertexId best = kInvalid;
  for (std::size_t v = 0; v < u.size(); ++v) {
    if (taken[v] || !(std::abs(u[v] - middle) > most)) continue;
    most = std::abs(u[v] - middle);
    best = static_cast<VertexId>(v);
  }
  return best;
}

// Cones of the linear conformal problem (the first Newton step): -L u = K - sum of charges, with
// u = 0 at base vertices. A charge is a cone's curvature.
class LinearPlacement {
 public:
  // `gradient`: evaluated at u = 0 with flat targets, so its value is the curvature K of the
  // surface. `base`: one flag per vertex, at least one set. Throws NotConverged if the Laplacian
  // cannot be factorized.
  LinearPlacement(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient,
                  std::vector<char> base, ExecutionContext& context)
      : taken_(std::move(base)), laplacian_(taken_) {
    if (!laplacian_.factorize(mesh, gradient, context)) {
      throw_not_converged(
          ErrorCode::kFactorizationFailed,
          "The Laplacian of the surface is not positive definite to working precision: its "
          "triangles are too degenerate. Remesh the surface.");
    }
    free_ = laplacian_.solve_pinned(gradient.value, context);
    for (double& x : free_) x = -x;
    for (const double x : gradient.value) total_curvature_ += x;
    u = free_;
  }

  // Puts a cone at v, with u = 0 there, and updates u and charge.
  void add(VertexId v, ExecutionContext& context) {
    green_.push_back(response(v, context));
    cones.push_back(v);
    taken_[at(v)] = 1;
    const auto k = static_cast<Eigen::Index>(cones.size());
    Eigen::MatrixXd a(k, k);
    Eigen::VectorXd b(k);
    for (Eigen::Index i = 0; i < k; ++i) {
      const std::size_t row = at(cones[static_cast<std::size_t>(i)]);
      b[i] = free_[row];
      for (Eigen::Index j = 0; j < k; ++j) a(i, j) = green_[static_cast<std::size_t>(j)][row];
    }
    // By way of a new vector: Eigen frees before it allocates, and would free again if it gets
    // none.
    charge = Eigen::VectorXd(-a.ldlt().solve(b));
    u = free_;
    for (std::size_t j = 0; j < cones.size(); ++j) {
      const double q = charge[static_cast<Eigen::Index>(j)];
      for (std::size_t w = 0; w < u.size(); ++w) u[w] += q * green_[j][w];
    }
  }
  // The vertex that is neither pinned nor a cone with the largest |u|; kInvalid if u = 0.
  VertexId extreme() const { return farthest(u, taken_, 0.0, 0.0); }
  // Largest minus smallest u, the base's zero included.
  double range() const {
    const auto [low, high] = std::minmax_element(u.begin(), u.end());
    return std::max(*high, 0.0) - std::min(*low, 0.0);
  }
  // What the base bears.
  double base_charge() const { return total_curvature_ - charge.sum(); }
  // Potential of a unit charge at v.
  std::vector<double> response(VertexId v, ExecutionContext& context) const {
    std::vector<double> unit(free_.size(), 0.0);
    unit[at(v)] = 1.0;
    return laplacian_.solve_pinned(unit, context);
  }

  std::vector<double> u;
  std::vector<VertexId> cones;
  Eigen::VectorXd charge;  // per cone

 private:
  std::vector<char> taken_;  // the base, and cones
  NewtonSystem laplacian_;
  double total_curvature_ = 0.0;  // of the surface
  std::vector<double> free_;
  std::vector<std::vector<double>> green_;
};

constexpr double kRelativeSlack = 1e-9;

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

  // Quanta of one cone: its angle stays positive.
  int most_steps() const {
    return static_cast<int>(std::ceil(2 * pi / options.quantum - kRelativeSlack)) - 1;
  }
  bool is_limited() const { return options.max_seconds > 0.0 || options.enough_seconds > 0.0; }
  // Seconds of a TimeLimit from where there are cones on.
  double enough_left() const {
    return options.enough_seconds > 0.0 ? std::max(0.0, options.enough_seconds - watch.seconds())
                                        : limit_of(0.0);
  }
};

// Cones whose curvatures are multiples of a quantum, such that the scale factor stays within a
// bound: a search over integers.
//
// A cone of a quarter turn is felt as log(distance / mesh size) / 4 in u around it, so cones that
// are rounded one by one leave peaks where two of opposite sign lie side by side. The search moves
// single quanta: the vertex with the largest u gives one away, or the one with the smallest u
// receives one, in exchange with the other extreme or a cone near by, whichever lowers the spread
// of u most. u responds linearly (Green's functions); the true metric is computed in between, and
// has the last word.
using ConeSteps = std::map<VertexId, int>;  // curvature of each cone, quanta; none is zero

// True metrics in a search, and of them in a row without a better one.
constexpr int kRounds = 16;
constexpr int kPatience = 3;
// Exchanges between two true metrics: the linear model is not trusted for more.
constexpr int kMovesPerRound = 12;
// Cones near an extreme that it may exchange a quantum with.
constexpr std::size_t kPartners = 16;
// So is the place of the opposite extreme in each of so many rings around it, which begin at 1, 2,
// 4, ... edges.
constexpr unsigned kRings = 7;
// The linear model aims below the bound, the true metric being a little different.
constexpr double kAim = 0.95;
constexpr std::size_t kMostNumbers = 32'000'000;  // of responses kept: 256 MB
constexpr double kLeastGain = 1e-3;               // of the cost, relative
constexpr double kMostConeSteps = 1e6;            // of negative curvature at one cone

// One quantum more at `to`, one less at `from`; kInvalid: none.
struct Exchange {
  VertexId to = kInvalid, from = kInvalid;
};

class Searcher {
 public:
  Searcher(const LinearPlacement& linear, const Problem& problem, ExecutionContext& context)
      : linear_(linear),
        problem_(problem),
        context_(context),
        adjacency_(problem.surface.adjacency()) {}

  // Exchanges until the linear model is content or none helps. False if there was none.
  bool improve(std::vector<double>& u, ConeSteps& cones) {
    for (int move = 0; move < kMovesPerRound; ++move) {
      context_.check();
      if (responses_.size() * u.size() > kMostNumbers) responses_.clear();
      const Extremes e = extremes_of(u);
      if (e.range <= kAim * problem_.allowed) return move > 0;
      const double present = cost(u, {});
      Exchange best;
      double least = present * (1.0 - kLeastGain);
      for (const Exchange& x : candidates(u, cones, e)) {
        if (!possible(cones, x)) continue;
        const double c = cost(u, x);
        if (c < least) least = c, best = x;
      }
      if (best.to == kInvalid && best.from == kInvalid) return move > 0;
      cost(u, best);
      std::swap(u, scratch_);
      change(cones, best.to, 1);
      change(cones, best.from, -1);
    }
    return true;
  }

 private:
  const std::vector<double>& response(VertexId v) {
    const auto known = responses_.find(v);
    if (known != responses_.end()) return known->second;
    return responses_.emplace(v, linear_.response(v, context_)).first->second;
  }

  static void change(ConeSteps& cones, VertexId v, int by) {
    if (v == kInvalid) return;
    if ((cones[v] += by) == 0) cones.erase(v);
  }
  static int steps_at(const ConeSteps& cones, VertexId v) {
    const auto it = cones.find(v);
    return it == cones.end() ? 0 : it->second;
  }

  bool possible(const ConeSteps& cones, const Exchange& x) const {
    if (x.to == x.from) return false;
    std::size_t fresh = 0;
    for (const VertexId v : {x.to, x.from}) {
      if (v == kInvalid) continue;
      if (problem_.on_boundary[at(v)]) return false;
      if (!cones.contains(v)) ++fresh;
    }
    if (x.to != kInvalid && steps_at(cones, x.to) >= problem_.most_steps()) return false;
    return fresh == 0 ||
           cones.size() + fresh <= static_cast<std::size_t>(problem_.options.max_cones);
  }

  // Exchanges of both extremes with each other, with cones near them and with places in rings
  // around them; alone, if a boundary takes the rest.
  std::vector<Exchange> candidates(const std::vector<double>& u, const ConeSteps& cones,
                                   const Extremes& e) {
    std::vector<Exchange> all{{e.low, e.high}};
    if (!problem_.closed) all.insert(all.end(), {{e.low, kInvalid}, {kInvalid, e.high}});
    for (const VertexId v : near(cones, e.low)) all.push_back({e.low, v});
    for (const VertexId v : near(cones, e.high)) all.push_back({v, e.high});
    for (const VertexId v : best_in_rings(e.low, u, 1.0)) all.push_back({e.low, v});
    for (const VertexId v : best_in_rings(e.high, u, -1.0)) all.push_back({v, e.high});
    return all;
  }

  // In every ring around v the vertex where sign * u is largest.
  std::vector<VertexId> best_in_rings(VertexId v, const std::vector<double>& u, double sign) const {
    std::vector<VertexId> best, front{v};
    if (problem_.on_boundary[at(v)]) return best;
    std::vector<char> seen(u.size(), 0);
    seen[at(v)] = 1;
    const auto visit = [&](VertexId w, std::vector<VertexId>& next) {
      if (std::exchange(seen[at(w)], 1) != 0) return;
      next.push_back(w);
      if (!problem_.on_boundary[at(w)] &&
          (best.back() == kInvalid || sign * u[at(w)] > sign * u[at(best.back())]))
        best.back() = w;
    };
    for (unsigned distance = 1; distance < 1u << kRings && !front.empty(); ++distance) {
      if (std::has_single_bit(distance)) best.push_back(kInvalid);
      std::vector<VertexId> next;
      for (const VertexId w : front) {
        HalfedgeId h = adjacency_.vertex_halfedge[at(w)];
        const HalfedgeId first = h;
        do {
          visit(mesh::target(problem_.surface.faces, h), next);
          visit(mesh::source(problem_.surface.faces, previous_corner(h)), next);
          h = mesh::rotate_ccw(adjacency_, h);
        } while (h != kInvalid && h != first);
      }
      front = std::move(next);
    }
    std::erase(best, kInvalid);
    return best;
  }

  // Cones in order of their influence on v.
  std::vector<VertexId> near(const ConeSteps& cones, VertexId v) {
    if (problem_.on_boundary[at(v)]) return {};
    const std::vector<double>& g = response(v);
    std::vector<VertexId> list;
    for (const auto& [c, steps] : cones) {
      if (c != v) list.push_back(c);
    }
    const std::size_t count = std::min(kPartners, list.size());
    std::partial_sort(
        list.begin(), list.begin() + static_cast<std::ptrdiff_t>(count), list.end(),
        [&](VertexId a, VertexId b) { return g[at(a)] != g[at(b)] ? g[at(a)] > g[at(b)] : a < b; });
    list.resize(count);
    return list;
  }

  // Of u after the exchange, which is left in scratch_: a high power of the distance from the
  // middle of the range, nearly the largest one, but it also falls when only one of several peaks
  // does.
  double cost(const std::vector<double>& u, const Exchange& x) {
    scratch_ = u;
    for (const auto& [v, quantum] : {std::pair(x.to, problem_.options.quantum),
                                     std::pair(x.from, -problem_.options.quantum)}) {
      if (v == kInvalid) continue;
      const std::vector<double>& potential = response(v);
      for (std::size_t w = 0; w < u.size(); ++w) scratch_[w] += quantum * potential[w];
    }
    const double middle = extremes_of(scratch_).middle, unit = 2.0 / problem_.allowed;
    double sum = 0.0;
    for (const double value : scratch_) {
      const double d = (value - middle) * unit, d2 = d * d, d4 = d2 * d2;
      sum += d4 * d4 * d4;
    }
    return sum;
  }

  const LinearPlacement& linear_;
  const Problem& problem_;
  ExecutionContext& context_;
  std::unordered_map<VertexId, std::vector<double>> responses_;
  std::vector<double> scratch_;
  const mesh::Adjacency& adjacency_;
};

// Prim's algorithm: the order in which points are reached, and the one that each hangs on.
struct Tree {
  std::vector<std::size_t> order, parent;
};
Tree shortest_tree(const mesh::Surface& surface, const std::vector<VertexId>& points) {
  const std::size_t count = points.size();
  Tree tree{{0}, std::vector<std::size_t>(count, 0)};
  std::vector<double> distance(count, std::numeric_limits<double>::infinity());
  std::vector<char> reached(count, 0);
  reached[0] = 1;
  while (tree.order.size() < count) {
    const std::size_t last = tree.order.back();
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (reached[i]) continue;
      const double d =
          (surface.vertices.row(points[i]) - surface.vertices.row(points[last])).squaredNorm();
      if (d < distance[i]) {
        distance[i] = d;
        tree.parent[i] = last;
      }
      if (nearest == 0 || distance[i] < distance[nearest]) nearest = i;
    }
    reached[nearest] = 1;
    tree.order.push_back(nearest);
  }
  return tree;
}

// Rounds angles (#V, of the cones given) to multiples. What rounding leaves goes to the next cone
// on a shortest tree through all of them, leaves first.
ConeSteps round_cones(const Problem& p, const std::vector<double>& angles,
                      const std::vector<VertexId>& cones) {
  ConeSteps out;
  if (cones.empty()) return out;
  const Tree tree = shortest_tree(p.surface, cones);
  std::vector<double> wanted;
  for (const VertexId v : cones) wanted.push_back((2 * pi - angles[at(v)]) / p.options.quantum);
  for (std::size_t k = cones.size(); k-- > 0;) {
    const std::size_t i = tree.order[k];
    // Curvatures of a surface too degenerate to have any are no numbers of steps.
    const double steps =
        std::isfinite(wanted[i])
            ? std::clamp(std::round(wanted[i]), -kMostConeSteps,
                         std::max(-kMostConeSteps, static_cast<double>(p.most_steps())))
            : 0.0;
    if (k > 0) wanted[tree.parent[i]] += wanted[i] - steps;
    if (steps != 0.0) out[cones[i]] = static_cast<int>(steps);
  }
  return out;
}

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

// Of a range of logarithms; finite.
double ratio_of(double range) {
  return std::min(std::exp(range), std::numeric_limits<double>::max());
}

Problem make_problem(const mesh::Surface& surface, const SuggestConesOptions& options,
                     const std::vector<bool>& on_boundary) {
  const auto count = static_cast<Index>(surface.vertices.rows());
  Problem p{surface, options, on_boundary, std::vector<double>(at(count)), true, 0, 0.0};
  for (std::size_t v = 0; v < p.flat.size(); ++v) {
    p.flat[v] = on_boundary[v] ? pi : 2 * pi;
    p.closed = p.closed && !on_boundary[v];
  }
  p.euler = mesh::topology(surface.faces, surface.adjacency()).euler();
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
bool is_usable(const ConformalMetric& metric) {
  return !metric.angles.empty() && metric.angle_error <= kUsableError &&
         std::all_of(metric.angles.begin(), metric.angles.end(),
                     [](double angle) { return angle > 0.0; });
}

// The true metric with u = 0 at the cones; more cones at its extremes until the bound holds.
ConformalMetric place_truly(const Problem& p, std::vector<char> pinned,
                            std::vector<VertexId>& cones, ExecutionContext& context) {
  for (const VertexId v : cones) pinned[at(v)] = 1;
  ConformalMetric metric;
  std::size_t measured = 0;  // cones of `metric`
  const bool in_time = ended_in_time([&] {
    for (int round = 0; round < kTrueRounds; ++round) {
      const TimeLimit enough(context, is_usable(metric) ? p.enough_left() : limit_of(0.0));
      const double done = 0.5 + 0.3 * round / kTrueRounds;
      context.report("suggest cones", done);
      const ProgressRange still(context, done, done);
      metric = compute_pinned_metric(p.surface, p.flat, pinned, kPinnedTolerance, context);
      measured = cones.size();
      bool positive = true;
      for (const double angle : metric.angles)
        positive = positive && angle >= p.options.least_angle;
      const bool usable = metric.converged || metric.angle_error < kUsableError;
      if (usable && positive && metric.scale_range <= p.allowed) break;
      if (static_cast<Index>(cones.size()) >= p.options.max_cones) break;
      const std::vector<double>& u = metric.scale_factors;
      const VertexId v = farthest(u, pinned, extremes_of(u).middle, -1.0);
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
    if (!(metric.angles[v] > 0.0) || !(metric.angle_error <= kUsableError)) {
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
  ConeSteps cones;
  std::vector<double> target_angles;  // the boundary's as they come out
  std::vector<double> u;              // empty: the metric was not reached
  double range = std::numeric_limits<double>::infinity();
};

// The true metric of cones with curvatures in quanta. A free boundary takes what they leave.
MeasuredCones measure(const Problem& p, const ConeSteps& cones, ExecutionContext& context) {
  MeasuredCones out{cones, p.flat, {}};
  for (const auto& [v, steps] : cones) out.target_angles[at(v)] -= steps * p.options.quantum;
  ConformalMetric reached;
  if (p.closed) {
    close_gauss_bonnet(out.target_angles, p.on_boundary, p.euler, kQuantumSpread);
    MetricOptions check;
    check.tolerance = kCheckTolerance;
    check.require_convergence = false;
    reached = compute_conformal_metric(p.surface, out.target_angles, check, context);
    if (!reached.converged) return out;
  } else {
    const std::vector<char> boundary(p.on_boundary.begin(), p.on_boundary.end());
    reached =
        compute_pinned_metric(p.surface, out.target_angles, boundary, kPinnedTolerance, context);
    if (!(reached.angle_error < kUsableError)) return out;
    out.target_angles = std::move(reached.angles);
  }
  out.u = std::move(reached.scale_factors);
  out.range = reached.scale_range;
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
  // What was measured best: it is the result also where time is over in the search for better.
  MeasuredCones best;
  std::optional<TimeLimit> enough;  // from the first ones on
  // Exchanges from some cones on, the true metric of each result measured. Ends when the range is
  // allowed, or when no exchange helps any more.
  const auto search = [&](ConeSteps cones) {
    Searcher searcher(linear, p, context);
    double least = std::numeric_limits<double>::infinity();
    for (int round = 0, failures = 0; round < kRounds && failures < kPatience; ++round) {
      context.report("round cones", static_cast<double>(round) / kRounds);
      // Other cones may have a metric, or can take the curvature in whole quanta.
      Outcome<MeasuredCones> measured = attempt_part([&] { return measure(p, cones, context); });
      if (!measured || measured->u.empty()) return;
      std::vector<double> u = measured->u;
      const double range_now = measured->range;
      failures = range_now < least ? 0 : failures + 1;
      least = std::min(least, range_now);
      if (range_now < best.range) {
        best = std::move(*measured);
        if (!enough) enough.emplace(context, p.enough_left());
      }
      if (range_now <= p.allowed || !searcher.improve(u, cones)) return;
    }
  };
  std::vector<double> angles = out.target_angles;
  std::vector<VertexId> cones = out.cones;
  const bool in_time = ended_in_time([&] {
    for (std::size_t i = 0; i <= kTighter.size(); ++i) {
      const double part = 0.2 / static_cast<double>(kTighter.size() + 1);
      const ProgressRange range(context, 0.8 + part * static_cast<double>(i),
                                0.8 + part * static_cast<double>(i + 1));
      search(round_cones(p, angles, cones));
      if (best.range <= p.allowed || i == kTighter.size()) break;
      cones.assign(out.cones.begin(), out.cones.begin() + (p.closed ? 1 : 0));
      cones.insert(cones.end(), linear.cones.begin(), linear.cones.end());
      place_linearly(p, kTighter[i] * p.allowed, linear, cones, context);
      angles = linear_angles(p, linear, cones.front());
    }
  });
  enough.reset();
  if (!in_time && (!p.is_limited() || best.u.empty())) throw TimeIsOver();
  if (best.u.empty() && !p.closed) best = measure(p, {}, context);
  if (best.u.empty()) {
    throw_not_converged(ErrorCode::kIterationLimit,
                        "The metric of the rounded cones was not reached. Use a finer mesh without "
                        "nearly degenerate triangles, or cones of any angle "
                        "(quarter_turns=False).");
  }
  out.target_angles = std::move(best.target_angles);
  out.scale_ratio = ratio_of(best.range);
  out.cones.clear();
  for (const auto& [v, steps] : best.cones) out.cones.push_back(v);
}

// As suggest_cones, within the limit of `context`.
SuggestedCones cones_in_time(const mesh::Surface& surface, const SuggestConesOptions& options,
                             ExecutionContext& context) {
  check_options(options);
  mesh::validate(surface, kConnected, context);

  EngineInput input = input_of(surface);
  const Problem p = make_problem(surface, options, input.setup.on_boundary);
  input.target = p.flat;

  SuggestedCones out;
  context.report("suggest cones", 0.0);
  const auto engine = make_engine(input, 53, context);
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
  const ConformalMetric metric = place_truly(p, std::move(pinned), out.cones, context);
  out.target_angles = metric.angles;
  out.scale_ratio = ratio_of(metric.scale_range);
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
