#include "flipfree/seamless/padding/straight/hole_tour.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace flipfree::seamless {
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

}  // namespace flipfree::seamless
