#include "flipfree/intrinsic/overlay/overlay_spread.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace flipfree::intrinsic {
namespace {

// The place of the i-th of so many, drawn towards an even spacing; not before `least`, where
// rounding has put the last one.
Between spread(const Between& b, std::size_t i, std::size_t count, double share, double& least) {
  const double even = static_cast<double>(i + 1) / static_cast<double>(count + 1);
  const double target = std::max((1.0 - share) * b.target, least) + share * even;
  least = target - share * even;
  const double rest = (1.0 - share) * b.source + share * (1.0 - even);
  return {std::min(rest, 1.0 - target), target};
}

Between reversed(const Between& b) { return {b.target, b.source}; }

}  // namespace

void spread_crossings(const OverlayTrace& trace, double share, OverlayPositions& positions) {
  for (std::size_t c = 0; c < trace.curves.size(); ++c) {
    const auto first = static_cast<std::size_t>(trace.begin[c]);
    const auto end = static_cast<std::size_t>(trace.begin[c + 1]);
    double least = 0.0;
    for (std::size_t i = first; i < end; ++i) {
      positions.on_curve[i] = spread(positions.on_curve[i], i - first, end - first, share, least);
    }
  }
  std::vector<std::size_t> order(trace.crossings.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto edge = [&](std::size_t i) { return trace.crossings[i].through >> 1; };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (edge(a) != edge(b)) return edge(a) < edge(b);
    return trace.crossings[a].position < trace.crossings[b].position;
  });
  for (std::size_t first = 0, end = 0; first < order.size(); first = end) {
    while (end < order.size() && edge(order[end]) == edge(order[first])) ++end;
    double least = 0.0;
    for (std::size_t i = first; i < end; ++i) {
      Between& b = positions.on_edge[order[i]];
      const bool forward = (trace.crossings[order[i]].through & 1) == 0;
      const Between moved = spread(forward ? b : reversed(b), i - first, end - first, share, least);
      b = forward ? moved : reversed(moved);
    }
  }
}

}  // namespace flipfree::intrinsic
