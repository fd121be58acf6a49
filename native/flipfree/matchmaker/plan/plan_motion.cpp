#include "flipfree/matchmaker/plan/plan_motion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/matchmaker/request/polygon.h"

namespace flipfree::matchmaker {
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
      free = pins_.move(k, way_[static_cast<std::size_t>(k)]);
    for (VertexId k = 0; free && k < count; ++k)
      free = pins_.move(k, to_[static_cast<std::size_t>(k)]);
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
