#include "flipfree/numeric/vertex_separator.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <utility>

namespace flipfree::numeric {

namespace {

// Keys to sweep along: where there is a drawing x, y, x + y, x - y (as ranks); then the distance
// from one end, and the difference of the distances from both ends.
constexpr int kDistanceKeys = 2;
constexpr int kAllKeys = 4 + kDistanceKeys;
constexpr int kBuckets = 512;
constexpr double kLeastSide = 0.30;  // smaller side of a sweep, share of the part
constexpr double kMostSide = 0.62;   // larger side during refinement
constexpr int kRefinePasses = 4;

// Breadth-first distances from `start`; kInvalid where it does not reach. Returns the vertices in
// visiting order.
std::vector<Index> distances(const Subgraph& part, Index start, std::vector<Index>& distance) {
  distance.assign(at(part.count()), kInvalid);
  std::vector<Index> queue;
  queue.reserve(at(part.count()));
  queue.push_back(start);
  distance[at(start)] = 0;
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const Index next = distance[at(queue[head])] + 1;
    for_neighbours(part, queue[head], [&](Index u) {
      if (distance[at(u)] != kInvalid) return;
      distance[at(u)] = next;
      queue.push_back(u);
    });
  }
  return queue;
}

// Sides when the part is not connected: components go to the lighter side, no separator.
std::vector<char> split_components(const Subgraph& part) {
  std::vector<char> side(at(part.count()), kSeparator);
  std::vector<Index> stack;
  Index weight[2] = {0, 0};
  for (Index seed = 0; seed < part.count(); ++seed) {
    if (side[at(seed)] != kSeparator) continue;
    const char to = weight[1] < weight[0] ? kRight : kLeft;
    stack.push_back(seed);
    side[at(seed)] = to;
    while (!stack.empty()) {
      const Index v = stack.back();
      stack.pop_back();
      ++weight[static_cast<int>(to)];
      for_neighbours(part, v, [&](Index u) {
        if (side[at(u)] != kSeparator) return;
        side[at(u)] = to;
        stack.push_back(u);
      });
    }
  }
  return side;
}

template <std::size_t kKeys>
using Buckets = std::array<std::uint16_t, kKeys>;

// Spreads values over the buckets. Returns false if they are all the same.
template <std::size_t kKeys, typename Value>
bool fill_buckets(const Subgraph& part, int key, std::vector<Buckets<kKeys>>& buckets,
                  Value value) {
  std::int64_t low = value(0);
  std::int64_t high = low;
  for (Index v = 1; v < part.count(); ++v) {
    low = std::min<std::int64_t>(low, value(v));
    high = std::max<std::int64_t>(high, value(v));
  }
  const std::int64_t width = high - low + 1;
  for (Index v = 0; v < part.count(); ++v) {
    const std::int64_t bucket =
        width <= kBuckets ? value(v) - low : (value(v) - low) * kBuckets / width;
    buckets[at(v)][at(key)] = static_cast<std::uint16_t>(bucket);
  }
  return high > low;
}

struct Sweep {
  double score = 0;
  int key = kInvalid;
  int cut = 0;            // left: bucket < cut
  bool from_left = true;  // the separator is taken from the left side
};

// Tries every cut of every key: the separator is the vertices of one side with a neighbour on the
// other.
template <std::size_t kKeys>
Sweep best_sweep(const Subgraph& part, const std::vector<Buckets<kKeys>>& buckets,
                 const std::array<bool, kKeys>& usable) {
  struct Counts {
    Index mass = 0;  // vertices in this bucket
    Index left = 0;  // differences of the separator sizes at this cut
    Index right = 0;
  };
  std::vector<std::array<Counts, kKeys>> counts(kBuckets + 1);
  for (Index v = 0; v < part.count(); ++v) {
    Buckets<kKeys> low = buckets[at(v)];
    Buckets<kKeys> high = low;
    for_neighbours(part, v, [&](Index u) {
      const Buckets<kKeys>& other = buckets[at(u)];
      for (std::size_t k = 0; k < kKeys; ++k) {
        low[k] = std::min(low[k], other[k]);
        high[k] = std::max(high[k], other[k]);
      }
    });
    const Buckets<kKeys>& own = buckets[at(v)];
    for (std::size_t k = 0; k < kKeys; ++k) {
      ++counts[own[k]][k].mass;
      ++counts[own[k] + 1u][k].left;  // in the left separator for own < cut <= high
      --counts[std::min<std::size_t>(high[k] + 1u, kBuckets)][k].left;
      ++counts[low[k] + 1u][k].right;  // in the right separator for low < cut <= own
      --counts[std::min<std::size_t>(own[k] + 1u, kBuckets)][k].right;
    }
  }
  Sweep best;
  for (std::size_t k = 0; k < kKeys; ++k) {
    if (!usable[k]) continue;
    Index below = 0;
    Index left = 0;
    Index right = 0;
    for (std::size_t cut = 1; cut < kBuckets; ++cut) {
      below += counts[cut - 1][k].mass;
      left += counts[cut][k].left;
      right += counts[cut][k].right;
      const double share =
          static_cast<double>(std::min(below, part.count() - below)) / part.count();
      if (share < kLeastSide) continue;
      // Uneven sides cost more further down.
      const double score = std::min(left, right) * (1.0 + 1.5 * (0.5 - share));
      if (best.key == kInvalid || score < best.score) {
        best = {score, static_cast<int>(k), static_cast<int>(cut), left <= right};
      }
    }
  }
  return best;
}

// Moves vertices out of the separator, pulling their neighbours on the far side in, while that
// helps; climbs over small hills and goes back to the best state seen.
class Refinement {
 public:
  Refinement(const Subgraph& part, std::vector<char>& side, const ExecutionContext& context)
      : part_(part), side_(side), context_(context), locked_(at(part.count()), 0) {
    for (const char s : side) ++weight_[at(s)];
  }

  void run() {
    for (int pass = 0; pass < kRefinePasses && improve(); ++pass) {
    }
  }

 private:
  struct Move {
    Index vertex;
    char to;
  };
  // Gains are at most 1; moves that cost kMostLoss and more never pay.
  static constexpr Index kMostLoss = 6;

  // Change of the separator's size, negated, when v leaves it for side `to`.
  Index gain(Index v, char to) const {
    Index pulled = 0;
    for_neighbours(part_, v, [&](Index u) { pulled += side_[at(u)] == 1 - to ? 1 : 0; });
    return 1 - pulled;
  }

  void push(Index v) {
    Index beside[3] = {0, 0, 0};
    for_neighbours(part_, v, [&](Index u) { ++beside[static_cast<int>(side_[at(u)])]; });
    for (const char to : {kLeft, kRight}) {
      const Index loss = beside[1 - to];
      if (loss >= kMostLoss) continue;
      moves_[at(loss)].push_back({v, to});
      least_loss_ = std::min(least_loss_, loss);
    }
  }

  // Takes the move with the largest gain, the last one pushed of several. False if none is left.
  bool pop(Move& move, Index& gain) {
    while (least_loss_ < kMostLoss && moves_[at(least_loss_)].empty()) ++least_loss_;
    if (least_loss_ == kMostLoss) return false;
    move = moves_[at(least_loss_)].back();
    moves_[at(least_loss_)].pop_back();
    gain = 1 - least_loss_;
    return true;
  }

  void put(Index v, char to) {
    log_.push_back({v, side_[at(v)]});
    --weight_[at(side_[at(v)])];
    side_[at(v)] = to;
    ++weight_[at(to)];
  }

  // One pass; true if the separator shrank, or stayed as small with better balance.
  bool improve() {
    const auto imbalance = [&] { return std::abs(weight_[0] - weight_[1]); };
    for (auto& moves : moves_) moves.clear();
    least_loss_ = kMostLoss;
    log_.clear();
    std::vector<Index> touched;
    for (Index v = 0; v < part_.count(); ++v) {
      if (side_[at(v)] == kSeparator) push(v);
    }
    const Index start = weight_[kSeparator];
    const Index start_imbalance = imbalance();
    Index best = start;
    Index best_imbalance = start_imbalance;
    std::size_t best_log = 0;
    Index idle = 0;
    const Index patience = std::max<Index>(40, start / 3);
    const auto most = static_cast<Index>(kMostSide * part_.count());
    Move move{};
    Index expected = 0;
    while (idle < patience && pop(move, expected)) {
      const Index v = move.vertex;
      if (side_[at(v)] != kSeparator || locked_[at(v)] || gain(v, move.to) != expected) continue;
      if (weight_[at(move.to)] >= most) continue;
      context_.check();
      locked_[at(v)] = 1;
      touched.push_back(v);
      put(v, move.to);
      for_neighbours(part_, v, [&](Index u) {
        if (side_[at(u)] == 1 - move.to) {
          context_.check();  // of a dense row even one move is much work
          put(u, kSeparator);
          if (!locked_[at(u)]) push(u);
          for_neighbours(part_, u, [&](Index w) {
            if (side_[at(w)] == kSeparator && !locked_[at(w)] && w != u) push(w);
          });
        } else if (side_[at(u)] == kSeparator && !locked_[at(u)]) {
          push(u);
        }
      });
      ++idle;
      if (weight_[kSeparator] < best ||
          (weight_[kSeparator] == best && imbalance() < best_imbalance)) {
        best = weight_[kSeparator];
        best_imbalance = imbalance();
        best_log = log_.size();
        idle = 0;
      }
    }
    while (log_.size() > best_log) {
      const auto [v, from] = log_.back();
      log_.pop_back();
      --weight_[at(side_[at(v)])];
      side_[at(v)] = from;
      ++weight_[at(from)];
    }
    for (const Index v : touched) locked_[at(v)] = 0;
    return best < start || best_imbalance < start_imbalance;
  }

  const Subgraph& part_;
  std::vector<char>& side_;
  const ExecutionContext& context_;
  std::vector<char> locked_;
  std::array<Index, 3> weight_{0, 0, 0};
  std::array<std::vector<Move>, kMostLoss> moves_;  // by loss
  Index least_loss_ = kMostLoss;
  std::vector<std::pair<Index, char>> log_;
};

// Vertices by bucket.
template <std::size_t kKeys>
std::vector<Index> sorted_by(const std::vector<Buckets<kKeys>>& buckets, std::size_t key) {
  std::array<Index, kBuckets + 1> begin{};
  for (const Buckets<kKeys>& b : buckets) ++begin[b[key] + 1u];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<Index> sorted(buckets.size());
  for (Index v = 0; v < static_cast<Index>(buckets.size()); ++v)
    sorted[at(begin[buckets[at(v)][key]]++)] = v;
  return sorted;
}

template <std::size_t kKeys>
std::vector<char> split(const Subgraph& part, std::vector<Index>& sorted,
                        const ExecutionContext& context) {
  std::vector<Index> from_one;
  std::vector<Index> from_other;
  Index one = 0;
  if (!part.ends_first || part.count() > 1000) {
    one = distances(part, 0, from_one).back();
    context.check();
  }
  const auto seen = distances(part, one, from_one);
  if (static_cast<Index>(seen.size()) < part.count()) return split_components(part);
  context.check();
  distances(part, seen.back(), from_other);
  context.check();

  std::vector<Buckets<kKeys>> buckets(at(part.count()));
  std::array<bool, kKeys> usable{};
  if constexpr (kKeys == kAllKeys) {
    const auto rank = [&](Index v, int axis) -> std::int64_t { return part.rank[at(v)][at(axis)]; };
    usable[0] = fill_buckets(part, 0, buckets, [&](Index v) { return rank(v, 0); });
    usable[1] = fill_buckets(part, 1, buckets, [&](Index v) { return rank(v, 1); });
    usable[2] = fill_buckets(part, 2, buckets, [&](Index v) { return rank(v, 0) + rank(v, 1); });
    usable[3] = fill_buckets(part, 3, buckets, [&](Index v) { return rank(v, 0) - rank(v, 1); });
    context.check();
  }
  constexpr int kFirst = kKeys - kDistanceKeys;
  usable[kFirst] =
      fill_buckets(part, kFirst, buckets, [&](Index v) -> std::int64_t { return from_one[at(v)]; });
  usable[kFirst + 1] = fill_buckets(part, kFirst + 1, buckets, [&](Index v) -> std::int64_t {
    return from_one[at(v)] - from_other[at(v)];
  });
  context.check();
  const Sweep sweep = best_sweep(part, buckets, usable);
  context.check();

  std::vector<char> side(at(part.count()));
  if (sweep.key == kInvalid) {
    // No cut is balanced (a star, a clique): half of the vertices by number.
    for (Index v = 0; v < part.count(); ++v) side[at(v)] = v < part.count() / 2 ? kLeft : kRight;
  } else {
    for (Index v = 0; v < part.count(); ++v) {
      side[at(v)] = buckets[at(v)][at(sweep.key)] < sweep.cut ? kLeft : kRight;
    }
    sorted = sorted_by(buckets, at(sweep.key));
  }
  const char donor = sweep.from_left ? kLeft : kRight;
  std::vector<Index> separator;
  for (Index v = 0; v < part.count(); ++v) {
    if (side[at(v)] != donor) continue;
    bool touches = false;
    for_neighbours(part, v, [&](Index u) { touches = touches || side[at(u)] == 1 - donor; });
    if (touches) separator.push_back(v);
  }
  for (const Index v : separator) side[at(v)] = kSeparator;
  Refinement(part, side, context).run();
  return side;
}

}  // namespace

std::vector<char> separate(const Subgraph& part, std::vector<Index>& sorted,
                           const ExecutionContext& context) {
  return part.rank.empty() ? split<kDistanceKeys>(part, sorted, context)
                           : split<kAllKeys>(part, sorted, context);
}

}  // namespace flipfree::numeric
