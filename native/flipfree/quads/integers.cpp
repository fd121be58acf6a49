// Integers for the edges of a coarse surface: the same flat surface, by a small change of its
// shape, as one of whole squares.
//
// Unknown is a Gaussian integer for every edge, in the chart of its face, with the map's quarter
// turns; triangles close, edges of borders and features keep their axis, every area is positive and
// every vertex has its angle: then no cone, corner or border is merged with another, and the area
// of the surface is the number of quads. Edges are rounded; what triangles then lack is sent along
// cheapest dual paths from one to another, a unit turning with the charts that it passes; then
// closed dual paths that lower the energy, symmetric Dirichlet of the change of shape, are applied
// as long as there are any (cancelling of negative cycles). No solver, no tolerance: whatever is
// tried, the conditions are kept in integers.
//
// Deviations from Bommes, Campen, Ebke, Alliez, Kobbelt, "Integer-Grid Maps for Reliable Quad
// Meshing" (2013), Campen, Bommes, Kobbelt, "Quantized Global Parametrization" (2015), and
// Heistermann, Warnett, Bommes, "Min-Deviation-Flow in Bi-directed Graphs for T-Mesh Quantization"
// (2023): no motorcycle graph and no T-mesh; lengths of arcs become vectors of edges, flow in a
// network becomes flow in the dual of a triangulation times the four directions.
#include "flipfree/quads/coarse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "flipfree/base/plane.h"

namespace flipfree::quads {

namespace {

constexpr std::array<Gauss, 4> kUnits = {Gauss{1, 0}, Gauss{0, 1}, Gauss{-1, 0}, Gauss{0, -1}};
constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Energy of a triangle without area, and of a vertex with the wrong angle: more than any other has.
constexpr double kNoArea = 1e9;
constexpr double kPull = 10.0;

class Descent {
 public:
  // Lengths of the map in quads, where there are `wanted` of them.
  Descent(CoarseSurface& coarse, const Prepared& p, const Scales& scales, double wanted,
          double count, ExecutionContext& context)
      : coarse_(coarse),
        map_(p.flat.surface),
        quarters_(p.quarters),
        scale_(scales.scale),
        count_(count),
        context_(context) {
    scale_by(std::sqrt(wanted));
  }

  void scale_by(double factor) {
    for (double& s : scale_) s *= factor;
  }

  // Every edge by itself, then closed.
  bool round() {
    const Index count = coarse_.halfedges();
    coarse_.has_integers = true;
    for (HalfedgeId h = 0; h < count; ++h) {
      const HalfedgeId o = coarse_[h].opposite;
      if (o != kInvalid && o < h) {
        coarse_[h].integer = -turned(coarse_[o].integer, coarse_[o].turn);
        continue;
      }
      const Vector2 v = wish(h);
      coarse_[h].integer = {std::llround(v.x()), std::llround(v.y())};
    }
    return close();
  }

  // Closed dual paths as long as one of them lowers the energy; then flips, and again.
  void descend(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      cancel_cycles();
      if (!flip_to_delaunay()) return;
    }
  }

  // With what the count is off by.
  double energy() const {
    double sum = price_of_count(0.5 * static_cast<double>(twice_area_in_quads(coarse_)));
    for (FaceId f = 0; f < coarse_.faces(); ++f) sum += energy(f);
    return sum;
  }

  // Areas are positive, and vertices have their angle: positive areas alone leave whole turns open,
  // one more here for one less there.
  bool is_valid() {
    for (FaceId f = 0; f < coarse_.faces(); ++f)
      if (area(f) <= 0) return false;
    for (HalfedgeId h = 0; h < coarse_.halfedges(); ++h)
      if (is_reversed(h, coarse_[h].integer)) return false;
    leaving_ = leaving(coarse_, quarters_.size());
    for (VertexId v = 0; at(v) < leaving_.size(); ++v)
      if (leaving_[at(v)] != kInvalid && !has_its_angle(v)) return false;
    return true;
  }

 private:
  Vector2 wish(HalfedgeId h) const { return scale_[at(h / 3)] * as_vector(coarse_[h].edge); }
  std::int64_t area(FaceId f) const { return coarse_.twice_area(f, &Side::integer); }
  bool has_its_angle(VertexId v) const {
    double angle = 0.0;
    around(coarse_, leaving_[at(v)], [&](HalfedgeId h) {
      angle += turn(as_vector(coarse_[h].integer), as_vector(-coarse_[previous_corner(h)].integer));
      return true;
    });
    return std::lround(angle / kQuarterTurn) == quarters_[at(v)];
  }
  // Edges of borders and features have an axis to keep; features their direction on it as well.
  bool has_axis(HalfedgeId h) const {
    return coarse_[h].opposite == kInvalid || coarse_[h].feature != 0;
  }
  bool is_reversed(HalfedgeId h, Gauss q) const {
    return coarse_[h].feature != 0 && dot(coarse_[h].edge, q) <= 0;
  }
  // Whether a unit may be added to such an edge: along its axis.
  bool along(HalfedgeId h, Index direction) const {
    return (coarse_[h].edge.y == 0) == (direction % 2 == 0);
  }

  // Symmetric Dirichlet energy of the triangle's change of shape, by area in quads; 1 per quad
  // where there is none.
  double energy(FaceId f, const std::array<Gauss, 3>& q) const {
    const std::int64_t doubled = cross(q[0], q[1]);
    double reversed = 0.0;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (is_reversed(h, q[at(h % 3)]))
        reversed += kNoArea * (1.0 - static_cast<double>(dot(coarse_[h].edge, q[at(h % 3)])) /
                                         as_vector(coarse_[h].edge).norm());
    }
    const Vector2 a = wish(3 * f), b = wish(3 * f + 1);
    const double before = cross(a, b);
    // |J|^2 times twice the area: sum of cotangents times squares, which is this.
    const Vector2 c = as_vector(q[0]), d = as_vector(q[1]);
    const double stretch = (c.squaredNorm() * b.squaredNorm() - 2.0 * c.dot(d) * a.dot(b) +
                            d.squaredNorm() * a.squaredNorm()) /
                           before;
    if (doubled <= 0) return kNoArea * (1.0 - static_cast<double>(doubled)) + stretch + reversed;
    const double ratio = before / static_cast<double>(doubled);
    return 0.125 * stretch * (1.0 + ratio * ratio) + reversed;
  }
  std::array<Gauss, 3> integers_of(FaceId f) const {
    return {coarse_[3 * f].integer, coarse_[3 * f + 1].integer, coarse_[3 * f + 2].integer};
  }
  double energy(FaceId f) const { return energy(f, integers_of(f)); }

  // Sends what triangles lack, or have too much, to each other. A node is a half-edge whose vector
  // was changed by a unit, direction d: its neighbour has to make up for it.
  bool close() {
    std::vector<Gauss> rest;
    for (FaceId f = 0; f < coarse_.faces(); ++f) {
      const auto q = integers_of(f);
      rest.push_back(q[0] + q[1] + q[2]);
    }
    for (FaceId f = 0; f < coarse_.faces(); ++f) {
      while (!(rest[at(f)] == Gauss{})) {
        context_.check();
        if (!send(f, rest)) return false;
      }
    }
    return true;
  }

  // What a unit more costs on the edge, in squared distance from the wish; not negative.
  double price(HalfedgeId h, Gauss unit) const {
    const Vector2 off = as_vector(coarse_[h].integer) - wish(h);
    return std::max(0.01, 1.0 + 2.0 * off.dot(as_vector(unit)));
  }

  bool send(FaceId f, std::vector<Gauss>& rest) {
    const Gauss left = rest[at(f)];
    // One unit of it, to be taken from f.
    const Index unit =
        std::abs(left.x) >= std::abs(left.y) ? (left.x > 0 ? 0 : 2) : (left.y > 0 ? 1 : 3);
    rest[at(f)] = left - kUnits[at(unit)];
    const std::size_t nodes = 4 * at(coarse_.halfedges());
    std::vector<double> distance(nodes, kInfinite);
    std::vector<Index> before(nodes, kInvalid);
    using Entry = std::pair<double, Index>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    const auto offer = [&](HalfedgeId h, Index d, double sum, Index from) {
      if (has_axis(h) && !along(h, d)) return;
      sum += price(h, kUnits[at(d)]);
      const Index node = 4 * h + d;
      if (sum >= distance[at(node)]) return;
      distance[at(node)] = sum;
      before[at(node)] = from;
      queue.emplace(sum, node);
    };
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) offer(h, (unit + 2) % 4, 0.0, kInvalid);
    while (!queue.empty()) {
      const auto [sum, node] = queue.top();
      queue.pop();
      if (sum > distance[at(node)]) continue;
      const HalfedgeId h = node / 4, o = coarse_[h].opposite;
      // The neighbour's sum has changed by -i^turn times the unit.
      const Index d = (node % 4 + (o == kInvalid ? 0 : coarse_[h].turn)) % 4;
      if (o == kInvalid || dot(rest[at(o / 3)], kUnits[at(d)]) > 0) {
        if (o != kInvalid) rest[at(o / 3)] = rest[at(o / 3)] - kUnits[at(d)];
        for (Index n = node; n != kInvalid; n = before[at(n)]) add(n / 4, n % 4);
        return true;
      }
      for (const HalfedgeId e : {next_corner(o), previous_corner(o)}) offer(e, d, sum, node);
    }
    return false;
  }

  // Adds the unit to the half-edge, and what goes with it to the other side.
  void add(HalfedgeId h, Index d) {
    const HalfedgeId o = coarse_[h].opposite;
    coarse_[h].integer = coarse_[h].integer + kUnits[at(d)];
    if (o != kInvalid)
      coarse_[o].integer = coarse_[o].integer - kUnits[at((d + coarse_[h].turn) % 4)];
  }

  // Steps of closed dual paths: through a face, in across half-edge `in` (which loses the unit d),
  // out across the next or the previous one (which gains it). Node 4 h + d: h gains the unit d.
  struct Step {
    HalfedgeId in = kInvalid;
    Index d = 0;
    Index which = 0;
    std::size_t index() const { return at(8 * in + 2 * d + which); }
    HalfedgeId out() const { return which == 0 ? next_corner(in) : previous_corner(in); }
  };

  void price_face(FaceId f) {
    const std::array<Gauss, 3> q = integers_of(f);
    const double now = energy(f, q);
    for (HalfedgeId in = 3 * f; in < 3 * f + 3; ++in) {
      for (Index d = 0; d < 4; ++d) {
        for (Index which = 0; which < 2; ++which) {
          const Step step{in, d, which};
          const HalfedgeId out = step.out();
          double& cost = cost_[step.index()];
          cost = kInfinite;
          if ((has_axis(in) && !along(in, d)) || (has_axis(out) && !along(out, d))) continue;
          std::array<Gauss, 3> changed = q;
          changed[at(in % 3)] = changed[at(in % 3)] - kUnits[at(d)];
          changed[at(out % 3)] = changed[at(out % 3)] + kUnits[at(d)];
          cost =
              energy(f, changed) - now +
              0.5 * bias_ * static_cast<double>(cross(changed[0], changed[1]) - cross(q[0], q[1]));
        }
      }
    }
  }

  // Squares of what the count is off by, as energy: one quad per hundred off has a tenth of a
  // quad's.
  double price_of_count(double count) const {
    return count_ > 0.0 ? kPull / count_ * (count - count_) * (count - count_) : 0.0;
  }
  void price_all() {
    if (count_ > 0.0) {
      quads_ = 0.5 * static_cast<double>(twice_area_in_quads(coarse_));
      bias_ = 2.0 * kPull / count_ * (quads_ - count_);
    }
    for (FaceId f = 0; f < coarse_.faces(); ++f) price_face(f);
  }

  Index outside() const { return 4 * coarse_.halfedges(); }
  void activate(Index node) {
    if (is_active_[at(node)] == 0) active_.push_back(node);
    is_active_[at(node)] = 1;
  }
  void lower(Index node, double sum, Index from, const Step& step) {
    distance_[at(node)] = sum;
    before_[at(node)] = from;
    step_to_[at(node)] = step;
    activate(node);
  }
  void relax(Index from, const Step& step) {
    const Index node = 4 * step.out() + step.d;
    const double sum = distance_[at(from)] + cost_[step.index()];
    if (sum < distance_[at(node)] - 1e-9 * (1.0 + std::abs(sum))) lower(node, sum, from, step);
  }

  // Bellman and Ford; a negative cycle shows among the predecessors after a few rounds. Whatever
  // the distances are at first, some can be lowered as long as there is one: once it is applied,
  // they stay, and only nodes from where steps have another price are looked at again.
  void cancel_cycles() {
    cost_.assign(8 * at(coarse_.halfedges()), kInfinite);
    price_all();
    blocked_.clear();
    leaving_ = leaving(coarse_, quarters_.size());
    const std::size_t nodes = at(outside()) + 1;
    seen_.assign(nodes, 0);
    pass_ = 0;
    // Distances kept are ever less exact: at last from none.
    for (bool lowered = true; lowered;) {
      lowered = false;
      distance_.assign(nodes, 0.0);
      before_.assign(nodes, kInvalid);
      step_to_.assign(nodes, {});
      is_active_.assign(nodes, 0);
      active_.clear();
      for (Index node = 0; node <= outside(); ++node) activate(node);
      while (!active_.empty()) {
        context_.check();
        std::vector<Index> sources;
        sources.swap(active_);
        std::sort(sources.begin(), sources.end());
        for (const Index node : sources) is_active_[at(node)] = 0;
        for (const Index node : sources) relax_from(node);
        lowered = apply_cycles() || lowered;
      }
    }
    blocked_.clear();
  }

  void relax_from(Index node) {
    if (node == outside()) {
      for (HalfedgeId in = 0; in < coarse_.halfedges(); ++in) {
        if (coarse_[in].opposite != kInvalid) continue;
        for (Index d = 0; d < 4; ++d)
          for (Index which = 0; which < 2; ++which) relax(node, {in, d, which});
      }
      return;
    }
    const HalfedgeId h = node / 4, o = coarse_[h].opposite;
    const Index d = node % 4;
    if (o != kInvalid) {
      const Index turned_d = (d + coarse_[h].turn) % 4;
      for (Index which = 0; which < 2; ++which) relax(node, {o, turned_d, which});
    } else if (along(h, d) && distance_[at(node)] < distance_[at(outside())]) {
      lower(outside(), distance_[at(node)], node, {});
    }
  }

  // Applies the cycles among the predecessors of what was lowered last that lower the energy, as it
  // is once all their steps are taken; of others a face that they pass twice is closed to them.
  // Whether any was applied.
  bool apply_cycles() {
    bool lowered = false;
    const std::vector<Index> last = active_;
    const std::int64_t first_pass = pass_;
    for (const Index start : last) {
      ++pass_;
      Index node = start;
      while (node != kInvalid && seen_[at(node)] <= first_pass) {
        seen_[at(node)] = pass_;
        node = before_[at(node)];
      }
      if (node == kInvalid || seen_[at(node)] != pass_) continue;
      std::vector<Step> steps;
      Index n = node;
      do {
        if (n != outside()) steps.push_back(step_to_[at(n)]);
        const Index next = before_[at(n)];
        before_[at(n)] = kInvalid;
        activate(n);
        n = next;
      } while (n != node);
      if (apply(steps))
        lowered = true;
      else if (!lowered)
        block(steps);
    }
    return lowered;
  }

  // A face's steps have another price.
  void reprice(FaceId f) {
    price_face(f);
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const HalfedgeId o = coarse_[h].opposite;
      for (Index d = 0; d < 4; ++d) {
        before_[at(4 * h + d)] = kInvalid;
        activate(o == kInvalid ? outside() : 4 * o + d);
      }
    }
  }

  // Takes the steps if that lowers the energy.
  bool apply(const std::vector<Step>& steps) {
    std::vector<FaceId> once;
    for (const Step& step : steps) once.push_back(step.in / 3);
    sort_unique(once);
    std::vector<VertexId> vertices;
    for (const FaceId f : once)
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) vertices.push_back(coarse_[h].source);
    sort_unique(vertices);
    const auto doubled = [&] {
      std::int64_t all = 0;
      for (const FaceId f : once) all += area(f);
      return all;
    };
    const std::int64_t before = doubled();
    const auto sum = [&] {
      double all = price_of_count(quads_ + 0.5 * static_cast<double>(doubled() - before));
      for (const FaceId f : once) all += energy(f);
      for (const VertexId v : vertices) all += has_its_angle(v) ? 0.0 : kNoArea;
      return all;
    };
    const double now = sum();
    const auto shift = [&](bool forth) {
      for (const Step& step : steps) {
        const Gauss unit = forth ? kUnits[at(step.d)] : -kUnits[at(step.d)];
        Gauss& in = coarse_[step.in].integer;
        in = in - unit;
        Gauss& out = coarse_[step.out()].integer;
        out = out + unit;
      }
    };
    shift(true);
    if (sum() < now - 1e-9 * now) {
      for (const Step& step : blocked_) reprice(step.in / 3);
      blocked_.clear();
      if (count_ > 0.0 && doubled() != before) {
        price_all();
        for (Index node = 0; node <= outside(); ++node) activate(node);
      }
      for (const FaceId f : once) reprice(f);
      return true;
    }
    shift(false);
    return false;
  }

  // Steps that are not worth their price together: of those that share a face none is taken until
  // something else has changed.
  void block(const std::vector<Step>& steps) {
    std::vector<Step> shared;
    for (const Step& step : steps)
      if (std::ranges::count(steps, step.in / 3, [](const Step& s) { return s.in / 3; }) > 1)
        shared.push_back(step);
    for (const Step& step : shared.empty() ? steps : shared) {
      cost_[step.index()] = kInfinite;
      blocked_.push_back(step);
    }
  }

  // Flips edges that are not Delaunay by the integers, and those of triangles without area by them
  // if that gives both one. True if any was.
  bool flip_to_delaunay() {
    bool any = false;
    std::size_t most = 20 * at(coarse_.halfedges()) + 100;
    for (bool changed = true; changed && most > 0;) {
      changed = false;
      for (HalfedgeId h = 0; h < coarse_.halfedges() && most > 0; ++h) {
        const HalfedgeId o = coarse_[h].opposite;
        if (o == kInvalid || o / 3 == h / 3 || coarse_[h].feature != 0) continue;
        const bool positive = area(h / 3) > 0 && area(o / 3) > 0;
        if (positive && is_delaunay(coarse_, h, &Side::integer)) continue;
        const Diamond real = diamond(coarse_, h);
        const Diamond whole = diamond(coarse_, h, &Side::integer);
        if (real.at_source() <= 0 || real.at_target() <= 0 || whole.at_source() <= 0 ||
            whole.at_target() <= 0 || !fits(real.diagonal) || !fits(whole.diagonal))
          continue;
        flip_coarse(coarse_, map_, h);
        --most;
        changed = any = true;
      }
    }
    return any;
  }

  CoarseSurface& coarse_;
  const FlatSurface& map_;
  const std::vector<Index>& quarters_;
  std::vector<double> scale_;  // per face
  double count_;
  double quads_ = 0.0;  // as of the last price_all()
  double bias_ = 0.0;   // what a quad more costs besides, as long as the count is off
  ExecutionContext& context_;
  std::vector<HalfedgeId> leaving_;  // as of the last flips
  std::vector<double> cost_;         // per Step::index()
  std::vector<Step> blocked_;        // steps whose cost is infinite although they are possible
  // Of cancel_cycles(), per node: 4 h + d as for Step, and one for all that is outside.
  std::vector<double> distance_;
  std::vector<Index> before_;
  std::vector<std::int64_t> seen_;
  std::vector<Step> step_to_;
  std::vector<char> is_active_;
  std::vector<Index> active_;  // nodes whose distance has changed
  std::int64_t pass_ = 0;
};

}  // namespace

bool choose_integers(CoarseSurface& coarse, const Prepared& p, const Scales& scales, double wanted,
                     double count, ExecutionContext& context) {
  constexpr int kRounds = 8, kFewRounds = 2;
  // So many times twice as large, where rounding leaves a triangle without area.
  constexpr int kMostSteps = 12;
  if (coarse.has_integers) {
    Descent descent(coarse, p, scales, wanted, count, context);
    if (descent.is_valid()) {
      descent.descend(kRounds);
      return descent.is_valid();
    }
  }
  // Begun at the size itself, and at twice that, from where it comes down by square roots of two:
  // the better of both.
  const CoarseSurface given = coarse;
  double least = kInfinite;
  for (int step = 0; step <= kMostSteps && (step < 2 || least == kInfinite); ++step) {
    CoarseSurface tried = given;
    Descent descent(tried, p, scales, wanted, count, context);
    descent.scale_by(std::ldexp(1.0, step));
    if (!descent.round()) break;
    descent.descend(kFewRounds);
    if (!descent.is_valid()) continue;
    for (int smaller = 0; smaller < 2 * step; ++smaller) {
      descent.scale_by(std::sqrt(0.5));
      descent.descend(kFewRounds);
    }
    descent.descend(kRounds);
    if (!descent.is_valid() || !(descent.energy() < least)) continue;
    least = descent.energy();
    coarse = std::move(tried);
  }
  return least < kInfinite;
}

std::int64_t twice_area_in_quads(const CoarseSurface& coarse) {
  std::int64_t sum = 0;
  for (FaceId f = 0; f < coarse.faces(); ++f) sum += coarse.twice_area(f, &Side::integer);
  return sum;
}

}  // namespace flipfree::quads
