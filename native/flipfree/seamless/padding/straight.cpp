#include "flipfree/seamless/padding/straight.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/numeric/cholesky/laplacian_factor.h"
#include "flipfree/seamless/padding/paths.h"
#include "flipfree/seamless/padding/segments.h"

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

namespace {

// Changes looked at in all, whatever the number of holes.
constexpr std::int64_t kTrials = 60'000'000;
constexpr std::size_t kLongestPart = 3;
// Of the sum of all costs: gains below are rounding.
constexpr double kNoGain = 1e-12;

using Costs = std::vector<std::vector<double>>;

class Tour {
 public:
  Tour(const Costs& cost, bool odd_couple, const ExecutionContext& context)
      : cost_(cost), odd_couple_(odd_couple), context_(context) {}

  // From this hole to its partner, each time to the nearest one.
  void begin(Index first) {
    std::vector<char> used(cost_.size(), 0);
    order_ = {first};
    used[at(first)] = used[at(partner_of(first))] = 1;
    while (order_.size() + 1 < cost_.size()) {
      Index nearest = kInvalid;
      for (Index hole = 0; at(hole) < cost_.size(); ++hole) {
        if (used[at(hole)] == 0 &&
            (nearest == kInvalid || step(order_.back(), hole) < step(order_.back(), nearest)))
          nearest = hole;
      }
      order_.push_back(nearest);
      used[at(nearest)] = 1;
    }
    order_.push_back(partner_of(first));
    if (odd_couple_ && !has_odd_couple(order_)) {
      const std::size_t i = order_[1] == partner_of(order_[2]) ? 2 : 1;
      std::swap(order_[i], order_[i + 1]);
    }
  }

  // Until no change is a gain, or there were so many trials.
  void improve(std::int64_t most) {
    const std::int64_t end = trials_ + most;
    least_gain_ = kNoGain * (1.0 + tour_cost(cost_, order_));
    while (trials_ < end && (reverse_part(end) || move_part(end))) context_.check();
  }

  std::int64_t trials() const { return trials_; }
  const std::vector<Index>& order() const { return order_; }

 private:
  double step(Index a, Index b) const { return cost_[at(a)][at(b)]; }

  bool take(std::vector<Index> changed) {
    if (odd_couple_ && !has_odd_couple(changed)) return false;
    order_ = std::move(changed);
    return true;
  }

  // The first gain by reversing what is between two places.
  bool reverse_part(std::int64_t end) {
    for (std::size_t i = 1; i + 2 < order_.size(); ++i) {
      for (std::size_t j = i + 1; j + 1 < order_.size(); ++j) {
        if (++trials_ >= end) return false;
        const double gain = step(order_[i - 1], order_[i]) + step(order_[j], order_[j + 1]) -
                            step(order_[i - 1], order_[j]) - step(order_[i], order_[j + 1]);
        if (gain <= least_gain_) continue;
        std::vector<Index> changed = order_;
        std::reverse(changed.begin() + static_cast<std::ptrdiff_t>(i),
                     changed.begin() + static_cast<std::ptrdiff_t>(j) + 1);
        if (take(std::move(changed))) return true;
      }
    }
    return false;
  }

  // The first gain by moving a part elsewhere, either way round.
  bool move_part(std::int64_t end) {
    for (std::size_t size = 1; size <= kLongestPart; ++size) {
      for (std::size_t i = 1; i + size < order_.size(); ++i) {
        const Index first = order_[i], last = order_[i + size - 1];
        const double left = step(order_[i - 1], first) + step(last, order_[i + size]) -
                            step(order_[i - 1], order_[i + size]);
        for (std::size_t j = 0; j + 1 < order_.size(); ++j) {
          if (j + 1 >= i && j < i + size) continue;  // in the part or at its place
          for (const bool turned : {false, true}) {
            if (++trials_ >= end) return false;
            const double gain = left + step(order_[j], order_[j + 1]) -
                                step(order_[j], turned ? last : first) -
                                step(turned ? first : last, order_[j + 1]);
            if (gain <= least_gain_) continue;
            if (move(i, size, j, turned)) return true;
          }
        }
      }
    }
    return false;
  }

  bool move(std::size_t from, std::size_t size, std::size_t behind, bool turned) {
    const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(from);
    std::vector<Index> part(begin, begin + static_cast<std::ptrdiff_t>(size));
    if (turned) std::reverse(part.begin(), part.end());
    const Index before = order_[behind];
    std::vector<Index> changed;
    for (std::size_t i = 0; i < order_.size(); ++i) {
      if (i >= from && i < from + size) continue;
      changed.push_back(order_[i]);
      if (order_[i] == before) changed.insert(changed.end(), part.begin(), part.end());
    }
    return take(std::move(changed));
  }

  const Costs& cost_;
  const bool odd_couple_;
  const ExecutionContext& context_;
  std::vector<Index> order_;
  std::int64_t trials_ = 0;
  double least_gain_ = 0.0;
};

}  // namespace

bool has_odd_couple(const std::vector<Index>& order) {
  std::vector<std::size_t> place(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) place[at(order[i])] = i;
  for (std::size_t i = 1; i + 1 < order.size(); ++i) {
    if (place[at(partner_of(order[i]))] % 2 == i % 2) return true;
  }
  return false;
}

double tour_cost(const Costs& cost, const std::vector<Index>& order) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < order.size(); ++i) sum += cost[at(order[i])][at(order[i + 1])];
  return sum;
}

std::vector<Index> hole_tour(const Costs& cost, bool odd_couple, const ExecutionContext& context) {
  const auto count = static_cast<Index>(cost.size());
  std::vector<Index> best;
  double least = std::numeric_limits<double>::infinity();
  Tour tour(cost, odd_couple, context);
  for (Index first = 0; first < count && tour.trials() < kTrials; first += 2) {
    context.check();
    tour.begin(first);
    tour.improve(2 * (kTrials - tour.trials()) / (count - first) + 1);
    const double now = tour_cost(cost, tour.order());
    if (now >= least && !best.empty()) continue;
    least = now;
    best = tour.order();
  }
  return best;
}

namespace {

constexpr double kLeastWeight = 0.01;
constexpr double kMostWeight = 100.0;

// At corner c of its face: the vectors along its two sides.
struct Corner {
  double dot, cross;
};
Corner corner_of(const mesh::Surface& surface, HalfedgeId c) {
  const auto place = [&](HalfedgeId h) -> Vector3 {
    return surface.vertices.row(surface.faces(h / 3, h % 3));
  };
  const Vector3 a = place(next_corner(c)) - place(c), b = place(previous_corner(c)) - place(c);
  return {a.dot(b), a.cross(b).norm()};
}

double range_of(const std::vector<double>& u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  return *high - *low;
}

}  // namespace

std::vector<double> edge_weights(const mesh::Surface& surface) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  std::vector<double> half(adjacency.opposite.size());
  for (HalfedgeId h = 0; at(h) < half.size(); ++h) {
    const Corner apex = corner_of(surface, previous_corner(h));
    half[at(h)] = 0.5 * apex.dot / std::max(apex.cross, 1e-300);
  }
  std::vector<double> weight(half.size());
  for (std::size_t h = 0; h < half.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[h];
    const double sum = half[h] + (o == kInvalid ? 0.0 : half[at(o)]);
    weight[h] = std::clamp(std::isfinite(sum) ? sum : 0.0, kLeastWeight, kMostWeight);
  }
  return weight;
}

std::vector<double> linear_scale(const mesh::Surface& surface, const std::vector<double>& weight,
                                 const std::vector<double>& wish, ExecutionContext& context) {
  std::vector<double> u = wish;
  std::vector<numeric::Coupling> couplings;
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const VertexId v = mesh::source(surface.faces, h), w = mesh::target(surface.faces, h);
    const Corner corner = corner_of(surface, h);
    u[at(v)] -= std::atan2(corner.cross, corner.dot);
    couplings.push_back({std::min(v, w), std::max(v, w), weight[at(h)]});
  }
  std::sort(couplings.begin(), couplings.end(), [](const auto& a, const auto& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  // Both half-edges of an edge have its weight.
  couplings.erase(
      std::unique(couplings.begin(), couplings.end(),
                  [](const auto& a, const auto& b) { return a.low == b.low && a.high == b.high; }),
      couplings.end());
  numeric::LaplacianFactor factor;
  if (!factor.factorize(static_cast<Index>(u.size()), couplings, context)) {
    throw_not_converged(ErrorCode::kFactorizationFailed,
                        "The cut of the engine \"padding\" found no flat angles of the surface. "
                        "Remove degenerate faces, or take the engine \"penner\".");
  }
  factor.solve(u, context);
  return u;
}

double scale_range(const AdmissibleCut& cut, const std::vector<Index>& cones,
                   ExecutionContext& context) {
  if (cut.branches.empty()) return 0.0;
  const auto count = static_cast<Index>(cut.surface.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(count, cut.surface.faces);
  std::vector<Index> all = cones;
  all.resize(at(count), 4);
  const OpenCut open = open_cut(cut, adjacency, cut_segments(cut, adjacency), all);
  const mesh::InOwnUnit scaled(cut.surface);
  double range = 0.0;
  for (const mesh::Chart& chart : mesh::split_into_charts(scaled.surface().vertices, open.mesh)) {
    std::vector<double> wish;
    for (const VertexId v : chart.vertices) wish.push_back(open.angle[at(v)]);
    range = std::max(
        range, range_of(linear_scale(chart.surface, edge_weights(chart.surface), wish, context)));
  }
  return range;
}

namespace {

constexpr int kTurningStepsPerCheck = 512;
constexpr double kSheetsPerQuarter = 2.0;
constexpr std::int64_t kNoSheet = -1;
constexpr std::size_t kMostPerSheet = 2;  // ways, times vertices

}  // namespace

void TurningSearch::start(HalfedgeId departure, double turned) {
  cross(departure, departure, kInvalid, turned, 0.0);
}

std::int64_t TurningSearch::key(HalfedgeId arrival, double turned) const {
  const double sheet = std::round(turned / TurnMeter::kQuarter * kSheetsPerQuarter);
  if (!(std::abs(sheet) <= static_cast<double>(sheets_))) return kNoSheet;
  const auto v = static_cast<std::int64_t>(meter_.canvas().mesh().target(arrival));
  return v * (2 * sheets_ + 1) + static_cast<std::int64_t>(sheet) + sheets_;
}

bool TurningSearch::meets_itself(Index way, VertexId v) const {
  const auto nearest = nearest_.find(v);
  if (nearest == nearest_.end()) return false;
  // The parts of the way that are shorter than any to v do not end there.
  for (; way != kInvalid && ways_[at(way)].length >= nearest->second; way = ways_[at(way)].before) {
    if (meter_.canvas().mesh().target(ways_[at(way)].arrival) == v) return true;
  }
  return false;
}

void TurningSearch::cross(HalfedgeId h, HalfedgeId first, Index before, double turned,
                          double length) {
  const Canvas& canvas = meter_.canvas();
  const VertexId v = canvas.mesh().target(h);
  length += meter_.length(h);
  if (canvas.on_curve(v)) arrivals_.push_back({before, h, first, turned, length});
  if (!canvas.is_free(v)) return;
  const double left = left_.empty() ? 0.0 : left_[at(v)];
  if (std::isinf(left)) return;
  const std::int64_t place = key(h, turned);
  if (place == kNoSheet) return;
  const auto [known, is_new] = shortest_.try_emplace(place, length);
  if (!is_new && known->second <= length) return;
  if (meets_itself(before, v)) {
    if (is_new) shortest_.erase(known);
    return;
  }
  known->second = length;
  const auto [nearest, is_first] = nearest_.try_emplace(v, length);
  if (!is_first) nearest->second = std::min(nearest->second, length);
  queue_.emplace_back(length + left, static_cast<Index>(ways_.size()));
  std::push_heap(queue_.begin(), queue_.end(), std::greater<>());
  ways_.push_back({h, first, before, turned, length});
}

void TurningSearch::run(const std::function<void(const Arrival&)>& arrive,
                        const std::function<double()>& limit, std::int64_t* ways_left,
                        const ExecutionContext& context) {
  const Canvas& canvas = meter_.canvas();
  const std::size_t most =
      kMostPerSheet * static_cast<std::size_t>(sheets_) * at(canvas.vertex_count());
  const auto call = [&] {
    for (const Arrival& arrival : arrivals_) arrive(arrival);
    arrivals_.clear();
  };
  call();
  for (int step = 1; !queue_.empty() && queue_.front().first < limit(); ++step) {
    if (step % kTurningStepsPerCheck == 0) context.check();
    if (ways_.size() > most) break;
    if (ways_left != nullptr && --*ways_left < 0) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "Curves of the cut that turn little were not found in so many trials.");
    }
    std::pop_heap(queue_.begin(), queue_.end(), std::greater<>());
    const Index index = queue_.back().second;
    queue_.pop_back();
    const Way way = ways_[at(index)];
    if (shortest_.at(key(way.arrival, way.turned)) < way.length) continue;  // a shorter one came
    meter_.for_each_turn(way.arrival, [&](HalfedgeId h, double turn) {
      cross(h, way.first, index, way.turned + turn, way.length);
    });
    call();
  }
}

std::vector<HalfedgeId> TurningSearch::path(const Arrival& arrival) const {
  std::vector<HalfedgeId> path = {arrival.halfedge};
  for (Index way = arrival.way; way != kInvalid; way = ways_[at(way)].before)
    path.push_back(ways_[at(way)].arrival);
  std::reverse(path.begin(), path.end());
  return path;
}

namespace {

// A loop that turns by less than this is straight.
constexpr double kStraight = 0.5 * TurnMeter::kQuarter;
constexpr int kStraighteningRounds = 4;
// Distances to all vertices take as long as one way for so many of them.
constexpr Index kWaysPerDistance = 4;
// Of a loop's cost: what the first search for another one may cost, and how much more each next.
constexpr double kFirstSearchShare = 1.0 / 32.0;
constexpr double kMoreShare = 2.0;

}  // namespace

std::vector<VertexId> crossing_cycle(const TurnMeter& meter, const std::vector<VertexId>& loop,
                                     const TurningPrice& price, double most,
                                     const ExecutionContext& context) {
  const Canvas& canvas = meter.canvas();
  const std::size_t n = loop.size();
  double least = most;
  std::vector<VertexId> cycle;
  std::vector<HalfedgeId> last;
  for (std::size_t i = 0; i < n; ++i) {
    canvas.for_each_inside(canvas.mesh().find(loop[i], loop[(i + n - 1) % n]),
                           [&](HalfedgeId h) { last.push_back(h); });
  }
  if (price.ways_left != nullptr) *price.ways_left -= canvas.vertex_count() / kWaysPerDistance;
  const std::vector<double> left_over = free_distances(canvas, last, kInvalid, context).distance;
  for (std::size_t i = 0; i < n; ++i) {
    context.check();
    const HalfedgeId left = canvas.mesh().find(loop[i], loop[(i + 1) % n]);
    const HalfedgeId right = canvas.mesh().find(loop[i], loop[(i + n - 1) % n]);
    TurningSearch search(meter, left_over);
    canvas.for_each_inside(left, [&](HalfedgeId h) { search.start(h, 0.0); });
    std::vector<HalfedgeId> path;
    search.run(
        [&](const TurningSearch::Arrival& arrival) {
          const HalfedgeId back = canvas.mesh().opposite(arrival.halfedge);
          if (canvas.mesh().source(back) != loop[i] || canvas.sector_of(back) != right) return;
          const double turned = arrival.turned + meter.turn(arrival.halfedge, arrival.first);
          const double cost = price.cost(arrival.length, turned);
          if (std::abs(turned) >= kStraight || cost >= least) return;
          least = cost;
          path = search.path(arrival);
        },
        [&] { return least; }, price.ways_left, context);
    if (path.empty()) continue;
    cycle.clear();
    for (const HalfedgeId h : path) cycle.push_back(canvas.mesh().source(h));
  }
  return cycle;
}

double loop_cost(const TurnMeter& meter, const std::vector<VertexId>& loop,
                 const TurningPrice& price) {
  double length = 0.0;
  for (const HalfedgeId h : meter.canvas().edges_of(loop)) length += meter.canvas().length(h);
  return price.cost(length, meter.turn(loop));
}

void straighten_loops(Canvas& canvas, const TurnMeter& meter, const TurningPrice& price,
                      std::span<std::vector<VertexId>> loops, const ExecutionContext& context) {
  // What crosses a new loop runs beside the old one: perhaps on the other side of a cone.
  std::vector<char> is_new(loops.size(), 0);
  for (int round = 0; round < kStraighteningRounds; ++round) {
    bool changed = false;
    for (std::size_t i = 0; i < loops.size(); ++i) {
      std::vector<VertexId>& loop = loops[i];
      if (is_new[i] == 0 && std::abs(meter.turn(loop)) < kStraight) continue;
      is_new[i] = 0;
      const double now = loop_cost(meter, loop, price);
      // What is found for little needs no search far around.
      std::vector<VertexId> cycle;
      for (double most = kFirstSearchShare * now; cycle.empty() && most < kMoreShare * now;
           most *= kMoreShare)
        cycle = crossing_cycle(meter, loop, price, std::min(most, now), context);
      if (cycle.empty()) continue;
      canvas.erase(canvas.edges_of(loop));
      canvas.draw(canvas.edges_of(cycle), Curve::kLoop);
      loop = std::move(cycle);
      is_new[i] = 1;
      changed = true;
    }
    if (!changed) return;
  }
}

}  // namespace flipfree::seamless
