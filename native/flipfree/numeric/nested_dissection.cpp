#include "flipfree/numeric/nested_dissection.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/types.h"

namespace flipfree::numeric {

namespace {

// near[v]: set of the neighbours of v, without v. outside[v]: neighbours beyond this graph that are
// eliminated later; they count as far as the input names them. Returns the local order.
std::vector<Index> minimum_degree(std::vector<std::uint64_t>& near,
                                  const std::vector<Index>& outside) {
  const auto count = static_cast<Index>(near.size());
  std::vector<Index> order;
  order.reserve(near.size());
  std::uint64_t left = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
  while (left != 0) {
    Index best = kInvalid;
    Index best_degree = 0;
    for (std::uint64_t set = left; set != 0; set &= set - 1) {
      const Index v = std::countr_zero(set);
      const Index degree = std::popcount(near[at(v)]) + outside[at(v)];
      if (best == kInvalid || degree < best_degree) {
        best = v;
        best_degree = degree;
      }
    }
    order.push_back(best);
    left &= ~(std::uint64_t{1} << best);
    const std::uint64_t clique = near[at(best)];
    for (std::uint64_t set = clique; set != 0; set &= set - 1) {
      const Index u = std::countr_zero(set);
      near[at(u)] |= clique;
      near[at(u)] &= ~((std::uint64_t{1} << u) | (std::uint64_t{1} << best));
    }
  }
  return order;
}

// Splits a graph in two by few vertices: one step of a nested dissection (nested_dissection.h,
// where the method and its sources are).

struct Subgraph : Graph {
  bool ends_first = false;  // is vertex 0 at an end?
};

enum Side : char { kLeft = 0, kRight = 1, kSeparator = 2 };

// Keys to sweep along: the distance from one end, and the difference of those from both ends.
constexpr std::size_t kKeys = 2;
constexpr int kBuckets = 512;
constexpr double kLeastSide = 0.30;  // smaller side of a sweep, share of the part

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

using Buckets = std::array<std::uint16_t, kKeys>;

// Spreads values over the buckets. Returns false if they are all the same.
template <typename Value>
bool fill_buckets(const Subgraph& part, int key, std::vector<Buckets>& buckets, Value value) {
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
Sweep best_sweep(const Subgraph& part, const std::vector<Buckets>& buckets,
                 const std::array<bool, kKeys>& usable) {
  struct Counts {
    Index mass = 0;  // vertices in this bucket
    Index left = 0;  // differences of the separator sizes at this cut
    Index right = 0;
  };
  std::vector<std::array<Counts, kKeys>> counts(kBuckets + 1);
  for (Index v = 0; v < part.count(); ++v) {
    Buckets low = buckets[at(v)];
    Buckets high = low;
    for_neighbours(part, v, [&](Index u) {
      const Buckets& other = buckets[at(u)];
      for (std::size_t k = 0; k < kKeys; ++k) {
        low[k] = std::min(low[k], other[k]);
        high[k] = std::max(high[k], other[k]);
      }
    });
    const Buckets& own = buckets[at(v)];
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

// Vertices by bucket.
std::vector<Index> sorted_by(const std::vector<Buckets>& buckets, std::size_t key) {
  std::array<Index, kBuckets + 1> begin{};
  for (const Buckets& b : buckets) ++begin[b[key] + 1u];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<Index> sorted(buckets.size());
  for (Index v = 0; v < static_cast<Index>(buckets.size()); ++v)
    sorted[at(begin[buckets[at(v)][key]]++)] = v;
  return sorted;
}

// The side of every vertex; no edge joins left and right. A graph that is not connected is split
// into its components, without a separator. `sorted` gets the vertices from one end to the other,
// or stays empty: so numbered, the vertices of a side have their neighbours near them, and the
// first one is at an end. Precondition: two vertices or more. Cost: some sweeps over the edges.
// Checks for cancel.
std::vector<char> separate(const Subgraph& part, std::vector<Index>& sorted,
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

  std::vector<Buckets> buckets(at(part.count()));
  std::array<bool, kKeys> usable{};
  usable[0] =
      fill_buckets(part, 0, buckets, [&](Index v) -> std::int64_t { return from_one[at(v)]; });
  usable[1] = fill_buckets(part, 1, buckets, [&](Index v) -> std::int64_t {
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
  return side;
}

constexpr Index kLeaf = 64;  // what minimum_degree() can order

// A subgraph with local numbers, and where its vertices go in the order.
struct Part : Subgraph {
  std::vector<Index> vertices;  // local -> vertex of the whole graph
  std::vector<Index> outside;   // neighbours already in separators
  Index begin = 0;              // first elimination position
};

std::vector<Index> leaf_order(const Part& part) {
  std::vector<std::uint64_t> near(at(part.count()), 0);
  for (Index v = 0; v < part.count(); ++v) {
    for_neighbours(part, v, [&](Index u) { near[at(v)] |= std::uint64_t{1} << u; });
  }
  return minimum_degree(near, part.outside);
}

// The vertices of one side as a part of their own, numbered in the order `sorted`.
Part extract(const Part& part, const std::vector<char>& side, char which,
             const std::vector<Index>& sorted, const std::vector<Index>& local, Index count) {
  Part child;
  child.neighbour.reserve(part.neighbour.size() * at(count) / at(part.count()) + 64);
  child.vertices.reserve(at(count));
  child.outside.reserve(at(count));
  child.offset.reserve(at(count) + 1);
  child.offset.push_back(0);
  for (const Index v : sorted) {
    if (side[at(v)] != which) continue;
    child.vertices.push_back(part.vertices[at(v)]);
    Index outside = part.outside[at(v)];
    for_neighbours(part, v, [&](Index u) {
      if (side[at(u)] == which) {
        child.neighbour.push_back(local[at(u)]);
      } else {
        ++outside;
      }
    });
    child.outside.push_back(outside);
    child.offset.push_back(static_cast<Index>(child.neighbour.size()));
  }
  return child;
}

// Orders a leaf, or orders the separator of a part and leaves its two sides in `children`.
void dissect(Part& part, std::vector<Index>& order, std::vector<Part>& children,
             const ExecutionContext& context) {
  if (part.count() <= kLeaf) {
    Index next = part.begin;
    for (const Index v : leaf_order(part)) order[at(next++)] = part.vertices[at(v)];
    return;
  }
  std::vector<Index> sorted;
  const std::vector<char> side = separate(part, sorted, context);
  context.check();
  const bool ends_first = !sorted.empty();
  if (!ends_first) {
    sorted.resize(at(part.count()));
    std::iota(sorted.begin(), sorted.end(), 0);
  }
  std::vector<Index> local(at(part.count()));
  std::array<Index, 3> count{0, 0, 0};
  for (const Index v : sorted) local[at(v)] = count[at(side[at(v)])]++;
  Index next = part.begin + count[kLeft] + count[kRight];
  for (const Index v : sorted) {
    if (side[at(v)] == kSeparator) order[at(next++)] = part.vertices[at(v)];
  }
  Index begin = part.begin;
  for (const char which : {kLeft, kRight}) {
    const Index n = count[at(which)];
    if (n == 0) continue;
    children.push_back(extract(part, side, which, sorted, local, n));
    children.back().ends_first = ends_first;
    children.back().begin = begin;
    begin += n;
    context.check();
  }
}

// A hub has so many neighbours, and so many times the mean; in smaller graphs there are none.
constexpr Index kLeastHub = 40;
constexpr double kHub = 8.0;
constexpr Index kGraphWithHubs = 1024;

std::vector<Index> hubs_of(const Graph& graph) {
  std::vector<Index> hubs;
  if (graph.count() < kGraphWithHubs) return hubs;
  const double mean = static_cast<double>(graph.neighbour.size()) / graph.count();
  const Index least = std::max(kLeastHub, static_cast<Index>(kHub * mean));
  for (Index v = 0; v < graph.count(); ++v) {
    if (graph.offset[at(v) + 1] - graph.offset[at(v)] >= least) hubs.push_back(v);
  }
  return hubs;
}

// Vertices with neighbours everywhere make all others near to each other, and no distance tells
// where a small separator is. So the graph is dissected without its hubs, which are ordered last.
Part without(const std::vector<Index>& hubs, const Graph& graph) {
  std::vector<Index> local(at(graph.count()), 0);
  for (const Index v : hubs) local[at(v)] = kInvalid;
  Part rest;
  for (Index v = 0; v < graph.count(); ++v) {
    if (local[at(v)] == kInvalid) continue;
    local[at(v)] = static_cast<Index>(rest.vertices.size());
    rest.vertices.push_back(v);
  }
  rest.offset.push_back(0);
  rest.neighbour.reserve(graph.neighbour.size());
  for (const Index v : rest.vertices) {
    for_neighbours(graph, v, [&](Index u) {
      if (local[at(u)] != kInvalid) rest.neighbour.push_back(local[at(u)]);
    });
    rest.offset.push_back(static_cast<Index>(rest.neighbour.size()));
  }
  rest.outside.assign(rest.vertices.size(), 0);
  return rest;
}

}  // namespace

std::vector<Index> nested_dissection(const Graph& graph, const ExecutionContext& context) {
  std::vector<Index> order(at(graph.count()));
  if (graph.count() == 0) return order;
  const std::vector<Index> hubs = hubs_of(graph);
  std::copy(hubs.begin(), hubs.end(), order.end() - static_cast<std::ptrdiff_t>(hubs.size()));
  std::vector<Part> parts;
  parts.push_back(without(hubs, graph));

  // All parts of a level at once. Parts below kSubtree are taken to their leaves by one task.
  constexpr Index kSubtree = 4096;
  while (!parts.empty()) {
    std::vector<std::vector<Part>> children(parts.size());
    parallel_for(context, parts.size(), 1, [&](std::size_t p, std::size_t, std::size_t) {
      std::vector<Part> stack;
      stack.push_back(std::move(parts[p]));
      while (!stack.empty()) {
        Part part = std::move(stack.back());
        stack.pop_back();
        dissect(part, order, part.count() > kSubtree ? children[p] : stack, context);
      }
    });
    parts.clear();
    for (auto& group : children) {
      for (Part& part : group) parts.push_back(std::move(part));
    }
  }
  return order;
}

}  // namespace flipfree::numeric
