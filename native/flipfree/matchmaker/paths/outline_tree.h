// The shortest tree that joins the points of a target domain to its outline along edges of a convex
// partition (Prim 1957), where lengths may grow while the tree does.
#pragma once

#include <cstddef>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/matchmaker/target/target_domain.h"

namespace flipfree::matchmaker {

// Calls take(edge, share of the points joined so far) for the edges of the tree, the shortest
// first; edges that are `settled` join their ends at no cost and are not taken. least_cost(edge): a
// lower bound, cheap; cost(edge): exact at the time of the call, not below it.
template <typename LeastCost, typename Cost, typename Take>
void join_to_outline(const TargetDomain& domain, const ConvexPartition& partition,
                     const std::vector<bool>& settled, const LeastCost& least_cost,
                     const Cost& cost, const Take& take) {
  using Candidate = std::pair<double, Index>;
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue;
  std::vector<bool> reached(domain.point.size(), false);
  const auto is_reached = [&](Index v) { return reached[static_cast<std::size_t>(v)]; };
  std::size_t count = 0;
  std::vector<Index> pending = domain.outline;
  const auto reach_pending = [&] {
    while (!pending.empty()) {
      const Index v = pending.back();
      pending.pop_back();
      if (is_reached(v)) continue;
      reached[static_cast<std::size_t>(v)] = true;
      ++count;
      for (const Index e : partition.around[static_cast<std::size_t>(v)]) {
        const auto& edge = partition.edges[static_cast<std::size_t>(e)];
        const Index other = edge.a == v ? edge.b : edge.a;
        if (edge.boundary || is_reached(other)) continue;
        if (settled[static_cast<std::size_t>(e)]) {
          pending.push_back(other);
        } else {
          queue.emplace(least_cost(e), e);
        }
      }
    }
  };
  reach_pending();
  while (!queue.empty()) {
    const Index e = queue.top().second;
    queue.pop();
    const auto& edge = partition.edges[static_cast<std::size_t>(e)];
    const bool a = is_reached(edge.a);
    if (a && is_reached(edge.b)) continue;
    const double now = cost(e);
    if (!queue.empty() && now > queue.top().first) {
      queue.emplace(now, e);
      continue;
    }
    take(e, static_cast<double>(count) / static_cast<double>(reached.size()));
    pending.push_back(a ? edge.b : edge.a);
    reach_pending();
  }
}

}  // namespace flipfree::matchmaker
