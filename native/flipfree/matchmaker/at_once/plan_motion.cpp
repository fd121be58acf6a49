#include "flipfree/matchmaker/at_once/plan_motion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/matchmaker/request/polygon.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// Steps that a straight move may be cut into.
constexpr int kMostSteps = 2000;
constexpr double kLeastStep = 1e-9;
// Rounding errors of the determinant below, in units of the rim's size to the fourth power: its
// terms are 12 at most then, and errors less than 1.2e-15 of their sum (Shewchuk 1997).
constexpr double kDoubt = 1.5e-14;

}  // namespace

MovingPins::MovingPins(const Polygon& rim, const std::vector<Vector2>& pins)
    : pins_(static_cast<Index>(pins.size())), place_(pins) {
  place_.insert(place_.end(), rim.begin(), rim.end());
  leaving_.assign(place_.size(), kInvalid);
  Vector2 low = rim.front();
  Vector2 high = rim.front();
  for (const Vector2& p : rim) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  doubt_ = kDoubt * std::pow((high - low).maxCoeff(), 4);
  const auto corners = static_cast<Index>(rim.size());
  for (Index i = 1; i + 1 < corners; ++i) {
    for (const Index c : {Index{0}, i, i + 1}) {
      leaving_[at(pins_ + c)] = static_cast<HalfedgeId>(corner_.size());
      corner_.push_back(pins_ + c);
      opposite_.push_back(kInvalid);
    }
    if (i > 1) link(3 * (i - 1), 3 * (i - 2) + 2);
  }
  crossings_.assign(corner_.size(), 0);
  along_.assign(corner_.size(), 0);
  for (Index v = 0; v < pins_ && valid_; ++v) valid_ = insert(v);
  std::fill(crossings_.begin(), crossings_.end(), 0);
  for (std::size_t h = 0; h < along_.size(); ++h) along_[h] = opposite_[h] == kInvalid ? 0 : 1;
  complexity_ = 0;
}

void MovingPins::link(HalfedgeId a, HalfedgeId b) {
  opposite_[at(a)] = b;
  if (b != kInvalid) opposite_[at(b)] = a;
}

void MovingPins::set(HalfedgeId h, std::int64_t crossings, char along) {
  crossings_[at(h)] = crossings;
  along_[at(h)] = along;
}

void MovingPins::open(HalfedgeId h) {
  if (opposite_[at(h)] != kInvalid) open_.push_back(h);
}

// Puts a vertex into the face that it lies in.
bool MovingPins::insert(VertexId v) {
  const Vector2& p = place(v);
  for (Index f = 0; f < face_count(); ++f) {
    int least = 1;
    for (Index k = 0; k < 3; ++k)
      least = std::min(least,
                       numeric::orientation(place(source(3 * f + k)), place(target(3 * f + k)), p));
    if (least < 0) continue;
    if (least == 0) return false;
    const VertexId c[3] = {corner(f, 0), corner(f, 1), corner(f, 2)};
    const HalfedgeId outer[3] = {opposite_[at(3 * f)], opposite_[at(3 * f + 1)],
                                 opposite_[at(3 * f + 2)]};
    const Index fresh = face_count();
    corner_.resize(corner_.size() + 6);
    opposite_.resize(corner_.size(), kInvalid);
    crossings_.resize(corner_.size(), 0);
    along_.resize(corner_.size(), 0);
    const Index face[3] = {f, fresh, fresh + 1};
    for (int k = 0; k < 3; ++k) {
      const HalfedgeId h = 3 * face[k];
      corner_[at(h)] = c[k];
      corner_[at(h + 1)] = c[(k + 1) % 3];
      corner_[at(h + 2)] = v;
      leaving_[at(c[k])] = h;
      link(h, outer[k]);
      open(h);
    }
    for (int k = 0; k < 3; ++k) link(3 * face[k] + 1, 3 * face[(k + 1) % 3] + 2);
    leaving_[at(v)] = 3 * f + 2;
    make_delaunay();
    return true;
  }
  return false;
}

void MovingPins::flip(HalfedgeId h) {
  const HalfedgeId o = opposite_[at(h)];
  const VertexId u = source(h);
  const VertexId v = target(h);
  const VertexId p = apex(h);
  const VertexId q = apex(o);
  struct Side {
    HalfedgeId opposite;
    std::int64_t crossings;
    char along;
  };
  const auto side = [&](HalfedgeId s) {
    return Side{opposite_[at(s)], crossings_[at(s)], along_[at(s)]};
  };
  const Side vp = side(next(h));
  const Side pu = side(previous(h));
  const Side uq = side(next(o));
  const Side qv = side(previous(o));
  const std::int64_t before = crossings(h);
  const intrinsic::FlippedCrossings after = intrinsic::after_flip(
      {before, vp.crossings, pu.crossings, uq.crossings, qv.crossings, along(h)});
  complexity_ += after.count - before;
  const HalfedgeId a = 3 * (h / 3);
  const HalfedgeId b = 3 * (o / 3);
  const VertexId corners[6] = {p, u, q, q, v, p};
  const Side sides[6] = {pu, uq, {}, qv, vp, {}};
  for (int k = 0; k < 6; ++k) {
    const HalfedgeId s = k < 3 ? a + k : b + k - 3;
    corner_[at(s)] = corners[k];
    leaving_[at(corners[k])] = s;
    if (k % 3 == 2) continue;
    link(s, sides[k].opposite);
    set(s, sides[k].crossings, sides[k].along);
  }
  link(a + 2, b + 2);
  set(a + 2, after.count, after.along ? 1 : 0);
  set(b + 2, after.count, after.along ? 1 : 0);
}

// Is the far corner across an inner edge outside the circle of the face, or on it?
bool MovingPins::is_delaunay(HalfedgeId h) const {
  const Vector2& u = place(source(h));
  const Vector2& v = place(target(h));
  const Vector2& p = place(apex(h));
  const Vector2& q = place(apex(opposite(h)));
  const Vector2 a = u - q;
  const Vector2 b = v - q;
  const Vector2 c = p - q;
  const double det = a.squaredNorm() * (b.x() * c.y() - b.y() * c.x()) +
                     b.squaredNorm() * (c.x() * a.y() - c.y() * a.x()) +
                     c.squaredNorm() * (a.x() * b.y() - a.y() * b.x());
  return std::abs(det) > doubt_ ? det < 0 : numeric::in_circle(u, v, p, q) <= 0;
}

void MovingPins::make_delaunay() {
  while (!open_.empty()) {
    const HalfedgeId h = open_.back();
    open_.pop_back();
    const HalfedgeId o = opposite_[at(h)];
    if (o == kInvalid) continue;
    if (is_delaunay(h)) continue;
    flip(h);
    const HalfedgeId a = 3 * (h / 3);
    const HalfedgeId b = 3 * (o / 3);
    for (const HalfedgeId s : {a, a + 1, b, b + 1}) open(s);
  }
}

bool MovingPins::star_is_positive(VertexId v, const Vector2& p) const {
  const HalfedgeId first = leaving(v);
  HalfedgeId h = first;
  do {
    if (numeric::orientation(p, place(target(h)), place(apex(h))) <= 0) return false;
    h = opposite(previous(h));
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
    const HalfedgeId first = leaving(pin);
    HalfedgeId h = first;
    do {
      open(h);
      open(next(h));
      h = opposite(previous(h));
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
    bool free = pins_.valid();
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
