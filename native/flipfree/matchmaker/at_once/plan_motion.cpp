#include "flipfree/matchmaker/at_once/plan_motion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/matchmaker/request/polygon.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// Steps that a straight move may be cut into.
constexpr int kMostSteps = 2000;
constexpr double kLeastStep = 1e-9;
// Rounding errors of the determinant below, in units of the rim's size to the fourth power: its
// terms are 12 at most then, and errors less than 1.2e-15 of their sum (Shewchuk 1997).
constexpr double kDoubt = 1.5e-14;

// The triangulation of the pins, closed by a vertex beyond the rim.
intrinsic::FlipMesh closed_triangulation(const Polygon& rim, const std::vector<Vector2>& pins) {
  const Triangles inside = triangulate_pins(rim, pins);
  const auto first = static_cast<Index>(pins.size());
  const auto corners = static_cast<Index>(rim.size());
  Triangles faces(inside.rows() + corners, 3);
  faces.topRows(inside.rows()) = inside;
  for (Index i = 0; i < corners; ++i)
    faces.row(inside.rows() + i) << first + (i + 1) % corners, first + i, first + corners;
  return intrinsic::build_intrinsic_mesh(first + corners + 1, faces).mesh;
}

}  // namespace

Triangles triangulate_pins(const Polygon& rim, const std::vector<Vector2>& pins) {
  // There the rim comes first.
  const auto count = static_cast<Index>(rim.size() + pins.size());
  Triangles faces = triangulate_embedded(rim, pins, {}).triangulation.faces();
  for (VertexId& v : faces.reshaped()) v = (v + static_cast<Index>(pins.size())) % count;
  return faces;
}

MovingPins::MovingPins(const Polygon& rim, const std::vector<Vector2>& pins)
    : place_(pins), arcs_(closed_triangulation(rim, pins)) {
  place_.insert(place_.end(), rim.begin(), rim.end());
  Vector2 low = rim.front();
  Vector2 high = rim.front();
  for (const Vector2& p : rim) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  doubt_ = kDoubt * std::pow((high - low).maxCoeff(), 4);
  leaving_.resize(place_.size() + 1);
  for (std::size_t h = 0; h < mesh().halfedge_count(); ++h)
    leaving_[at(mesh().origin[h])] = static_cast<HalfedgeId>(h);
}

bool MovingPins::bound(HalfedgeId h) const {
  const auto beyond = static_cast<VertexId>(place_.size());
  return mesh().origin_of(h) == beyond || mesh().target(h) == beyond || apex(h) == beyond ||
         apex(mesh().opposite(h)) == beyond;
}

void MovingPins::flip(HalfedgeId h) {
  const HalfedgeId o = mesh().opposite(h);
  leaving_[at(mesh().origin_of(h))] = mesh().next_of(o);
  leaving_[at(mesh().origin_of(o))] = mesh().next_of(h);
  complexity_ -= arcs_.crossings(h);
  arcs_.flip(h);
  complexity_ += arcs_.crossings(h);
}

// Is the far corner across an inner edge outside the circle of the face, or on it?
bool MovingPins::is_delaunay(HalfedgeId h) const {
  const Vector2& u = place(mesh().origin_of(h));
  const Vector2& v = place(mesh().target(h));
  const Vector2& p = place(apex(h));
  const Vector2& q = place(apex(mesh().opposite(h)));
  const Vector2 a = u - q;
  const Vector2 b = v - q;
  const Vector2 c = p - q;
  const double det =
      a.squaredNorm() * cross(b, c) + b.squaredNorm() * cross(c, a) + c.squaredNorm() * cross(a, b);
  return std::abs(det) > doubt_ ? det < 0 : numeric::in_circle(u, v, p, q) <= 0;
}

void MovingPins::make_delaunay() {
  while (!open_.empty()) {
    const HalfedgeId h = open_.back();
    open_.pop_back();
    if (bound(h) || is_delaunay(h)) continue;
    flip(h);
    for (const HalfedgeId side : {h, mesh().opposite(h)}) {
      open_.push_back(mesh().next_of(side));
      open_.push_back(mesh().previous(side));
    }
  }
}

bool MovingPins::star_is_positive(VertexId v, const Vector2& p) const {
  const HalfedgeId first = leaving_[at(v)];
  HalfedgeId h = first;
  do {
    if (numeric::orientation(p, place(mesh().target(h)), place(apex(h))) <= 0) return false;
    h = mesh().rotate_ccw(h);
  } while (h != first);
  return true;
}

bool MovingPins::move(VertexId pin, const Vector2& to) {
  double step = 1.0;  // share of what is left
  for (int i = 0; i < kMostSteps; ++i) {
    const Vector2 from = place(pin);
    const Vector2 next_place = step == 1.0 ? to : Vector2(from + step * (to - from));
    if (!star_is_positive(pin, next_place)) {
      step *= 0.5;
      if (step < kLeastStep) return false;
      continue;
    }
    place_[at(pin)] = next_place;
    const HalfedgeId first = leaving_[at(pin)];
    HalfedgeId h = first;
    do {
      open_.push_back(h);
      open_.push_back(mesh().next_of(h));
      h = mesh().rotate_ccw(h);
    } while (h != first);
    make_delaunay();
    if (step == 1.0) return true;
    step = std::min(1.0, 4.0 * step);
  }
  return false;
}

namespace {

// Independent searches, and trials per pin in each.
constexpr std::size_t kSearches = 4;
constexpr int kTrialsPerPin = 350;
// Temperature at the beginning, in units of the logarithm of the complexity; it falls evenly to
// zero.
constexpr double kTemperature = 0.02;
// The farthest that a place on the way is shifted, in units of the rim's size; most are shifted
// less.
constexpr double kFarthest = 0.75;
constexpr double kNearest = 0.005;

// Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators".
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(next() % n); }

 private:
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

class Search {
 public:
  Search(const Polygon& rim, const std::vector<Vector2>& from, const std::vector<Vector2>& to,
         std::uint64_t seed)
      : rim_(rim), to_(to), random_(seed), before_(from.size(), MovingPins(rim, from)) {
    for (std::size_t i = 0; i < from.size(); ++i) way_.push_back(0.5 * (from[i] + to[i]));
    first_ = from.size();
    for (const Vector2& a : rim) size_ = std::max(size_, (a - rim[0]).norm());
  }

  void run(ExecutionContext& context) {
    double now = travel(0);
    const int trials = kTrialsPerPin * static_cast<int>(to_.size());
    for (int trial = 0; trial < trials; ++trial) {
      if (trial % 64 == 0) context.check();
      const std::size_t i = random_.below(to_.size());
      const double reach = size_ * (kNearest + kFarthest * std::pow(random_.unit(), 2));
      const Vector2 shift(2 * random_.unit() - 1, 2 * random_.unit() - 1);
      const double luck = random_.unit();
      const Vector2 old = way_[i];
      const Vector2 place = old + reach * shift;
      if (locate_in_polygon(rim_, place) <= 0) continue;
      way_[i] = place;
      const double next = travel(i);
      const double heat = kTemperature * (1.0 - static_cast<double>(trial) / trials);
      if (next <= now || next - now < -heat * std::log(luck)) {
        now = next;
        first_ = std::min(first_, i);
        for (std::size_t k = i + 1; k < to_.size(); ++k) {
          before_[k] = before_[k - 1];
          before_[k].move(static_cast<VertexId>(k - 1), way_[k - 1]);
        }
      } else {
        way_[i] = old;
      }
    }
  }

  // Infinite if no motion was found.
  double cost() const { return best_; }
  std::vector<PinMove> motion() const {
    std::vector<PinMove> moves;
    for (const std::vector<Vector2>* places : {&std::as_const(best_way_), &to_}) {
      for (std::size_t i = 0; i < to_.size(); ++i)
        moves.push_back({static_cast<VertexId>(i), (*places)[i]});
    }
    return moves;
  }

 private:
  // The less, the better; infinite if pins, from i on setting out anew, get stuck.
  double travel(std::size_t i) {
    pins_ = before_[i];
    const auto count = static_cast<VertexId>(to_.size());
    bool free = true;
    for (auto k = static_cast<VertexId>(i); free && k < count; ++k)
      free = pins_.move(k, way_[at(k)]);
    for (VertexId k = 0; free && k < count; ++k) free = pins_.move(k, to_[at(k)]);
    if (!free) return std::numeric_limits<double>::infinity();
    const double cost = std::log(1.0 + static_cast<double>(pins_.complexity()));
    if (cost < best_ && std::min(i, first_) == 0) {
      best_ = cost;
      best_way_ = way_;
    }
    return cost;
  }

  const Polygon& rim_;
  const std::vector<Vector2>& to_;
  Random random_;
  double size_ = 0;
  std::vector<Vector2> way_;
  std::vector<MovingPins> before_;  // as pin i sets out to its place on the way
  std::size_t first_ = 0;           // in before_, pins before this one have not set out yet
  MovingPins pins_ = before_[0];
  double best_ = std::numeric_limits<double>::infinity();
  std::vector<Vector2> best_way_;
};

}  // namespace

std::vector<PinMove> plan_motion(const Polygon& rim, const std::vector<Vector2>& from,
                                 const std::vector<Vector2>& to, ExecutionContext& context) {
  struct Found {
    double cost = std::numeric_limits<double>::infinity();
    std::vector<PinMove> moves;
  };
  std::vector<Found> found(kSearches);
  parallel_for(context, kSearches, 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      Search search(rim, from, to, i);
      search.run(context);
      if (std::isfinite(search.cost())) found[i] = {search.cost(), search.motion()};
    }
  });
  return std::min_element(found.begin(), found.end(),
                          [](const Found& a, const Found& b) { return a.cost < b.cost; })
      ->moves;
}

}  // namespace flipfree::matchmaker
