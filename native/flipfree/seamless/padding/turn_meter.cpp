#include "flipfree/seamless/padding/turn_meter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/numeric/cholesky/laplacian_factor.h"

namespace flipfree::seamless {

namespace {

// Cotangent weights are kept between these: a needle is not to decide.
constexpr double kLeastWeight = 0.01;
constexpr double kMostWeight = 100.0;

// Scale factors u by which angles become others to first order, zero at the last vertex, and the
// cotangent weights of edges, per half-edge.
struct LinearScale {
  std::vector<double> u, weight;
};

// `angle`: per vertex, radians, of the right sum.
LinearScale linear_scale(const mesh::Surface& surface, const std::vector<double>& angle,
                         ExecutionContext& context) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  LinearScale found{angle, std::vector<double>(adjacency.opposite.size(), 0.0)};
  auto& [u, weight] = found;
  const auto place = [&](HalfedgeId h) -> Vector3 {
    return surface.vertices.row(mesh::source(surface.faces, h));
  };
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const HalfedgeId beyond = next_corner(h);  // the edge opposite of the corner
    const HalfedgeId back = adjacency.opposite[at(beyond)];
    const Vector3 a = place(beyond) - place(h), b = place(previous_corner(h)) - place(h);
    const double dot = a.dot(b), cross = a.cross(b).norm();
    u[at(mesh::source(surface.faces, h))] -= std::atan2(cross, dot);
    weight[at(beyond)] += 0.5 * dot / std::max(cross, 1e-300);
    if (back != kInvalid) weight[at(back)] += 0.5 * dot / std::max(cross, 1e-300);
  }
  for (double& w : weight)
    w = std::isfinite(w) ? std::clamp(w, kLeastWeight, kMostWeight) : kLeastWeight;
  std::vector<numeric::Coupling> couplings;
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const auto [low, high] =
        std::minmax({mesh::source(surface.faces, h), mesh::target(surface.faces, h)});
    const HalfedgeId back = adjacency.opposite[at(h)];
    if (back == kInvalid || h < back) couplings.push_back({low, high, weight[at(h)]});
  }
  std::sort(couplings.begin(), couplings.end(), [](const auto& a, const auto& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  numeric::LaplacianFactor factor;
  if (!factor.factorize(static_cast<Index>(u.size()), couplings, context)) {
    throw_not_converged(ErrorCode::kFactorizationFailed,
                        "The cut of the engine \"padding\" found no flat angles of the surface. "
                        "Remove degenerate faces, or take the engine \"penner\".");
  }
  factor.solve(u, context);
  return found;
}

}  // namespace

std::vector<double> flat_crossings(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   ExecutionContext& context) {
  std::vector<double> angle;
  for (const Index k : cones) angle.push_back(k * TurnMeter::kQuarter);
  auto [u, crossings] = linear_scale(surface, angle, context);
  for (HalfedgeId h = 0; at(h) < crossings.size(); ++h) {
    crossings[at(h)] *=
        u[at(mesh::source(surface.faces, h))] - u[at(mesh::target(surface.faces, h))];
  }
  return crossings;
}

double scale_range(const AdmissibleCut& cut, std::vector<Index> cones, ExecutionContext& context) {
  const auto count = static_cast<Index>(cut.surface.vertices.rows());
  cones.resize(at(count), 4);
  const mesh::Adjacency& adjacency = cut.surface.adjacency();
  double range = 0.0;
  for (const auto& [chart, angle] :
       cut_pieces(cut, adjacency, cut_segments(cut, adjacency), cones)) {
    const std::vector<double> u = linear_scale(chart.surface, angle, context).u;
    const auto [low, high] = std::minmax_element(u.begin(), u.end());
    range = std::max(range, *high - *low);
  }
  return range;
}

void TurnMeter::forget() const {
  vertex_count_ = canvas_.vertex_count();
  known_.assign(at(canvas_.mesh().halfedge_slots()), {});
}

void TurnMeter::measure(HalfedgeId h, Known& entry) const {
  const double a = canvas_.length(h), b = canvas_.length(previous_corner(h)),
               c = canvas_.length(next_corner(h));
  // Half of it, which needles do not spoil (Kahan).
  const double s = 0.5 * (a + b + c);
  const double corner = 2.0 * std::atan2(std::sqrt(std::max(0.0, (s - a) * (s - b))),
                                         std::sqrt(std::max(0.0, s * (s - c))));
  const HalfedgeId side = canvas_.input_side(h);
  entry = {corner, side == kInvalid ? 0.0 : crossings_[at(side)], a};
}

double TurnMeter::turn(HalfedgeId arrival, HalfedgeId departure) const {
  double result = 0.0;
  bool met = false;
  for_each_turn(arrival, [&](HalfedgeId h, double turn) {
    if (h != departure) return;
    result = turn;
    met = true;
  });
  if (!met) throw InternalError("a turn between half-edges that do not meet");
  return result;
}

double TurnMeter::angle_between(HalfedgeId first, HalfedgeId second) const {
  double angle = 0.0;
  for (HalfedgeId h = first; h != second;) {
    angle += corner(h);
    h = canvas_.mesh().rotate_ccw(h);
    if (h != second) angle += crossing(h);
  }
  return angle;
}

double TurnMeter::turn(const std::vector<VertexId>& cycle) const {
  const std::size_t n = cycle.size();
  double sum = 0.0;
  HalfedgeId arrival = canvas_.mesh().find(cycle[n - 1], cycle[0]);
  for (std::size_t i = 0; i < n; ++i) {
    const HalfedgeId departure = canvas_.mesh().find(cycle[i], cycle[(i + 1) % n]);
    sum += turn(arrival, departure);
    arrival = departure;
  }
  return sum;
}

}  // namespace flipfree::seamless
