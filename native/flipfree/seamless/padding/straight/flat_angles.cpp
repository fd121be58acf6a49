#include "flipfree/seamless/padding/straight/flat_angles.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/seamless/padding/straight/linear_scale.h"

namespace flipfree::seamless {

std::vector<double> flat_crossings(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   ExecutionContext& context) {
  std::vector<double> wish(cones.size());
  for (std::size_t v = 0; v < cones.size(); ++v) wish[v] = cones[v] * TurnMeter::kQuarter;
  const std::vector<double> weight = edge_weights(surface);
  const std::vector<double> u = linear_scale(surface, weight, wish, context);
  std::vector<double> crossings(weight.size());
  for (HalfedgeId h = 0; at(h) < crossings.size(); ++h) {
    const VertexId v = mesh::source(surface.faces, h), w = mesh::target(surface.faces, h);
    crossings[at(h)] = weight[at(h)] * (u[at(v)] - u[at(w)]);
  }
  return crossings;
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
