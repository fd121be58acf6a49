#include "flipfree/seamless/padding/topology/straight/straight_loops.h"

#include <cmath>
#include <cstddef>

namespace flipfree::seamless {
namespace {

// A loop that turns by less than this is straight.
constexpr double kStraight = 0.5 * TurnMeter::kQuarter;
constexpr int kRounds = 3;

std::vector<HalfedgeId> edges_of(const Canvas& canvas, const std::vector<VertexId>& cycle) {
  std::vector<HalfedgeId> edges;
  for (std::size_t i = 0; i < cycle.size(); ++i)
    edges.push_back(canvas.mesh().find(cycle[i], cycle[(i + 1) % cycle.size()]));
  return edges;
}

}  // namespace

std::vector<VertexId> crossing_cycle(const TurnMeter& meter, const std::vector<VertexId>& loop,
                                     const TurningPrice& price, double most,
                                     const ExecutionContext& context) {
  const Canvas& canvas = meter.canvas();
  const std::size_t n = loop.size();
  double least = most;
  std::vector<VertexId> cycle;
  for (std::size_t i = 0; i < n; ++i) {
    context.check();
    const HalfedgeId left = canvas.mesh().find(loop[i], loop[(i + 1) % n]);
    const HalfedgeId right = canvas.mesh().find(loop[i], loop[(i + n - 1) % n]);
    TurningSearch search(meter);
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
        [&] { return least; }, context);
    if (path.empty()) continue;
    cycle.clear();
    for (const HalfedgeId h : path) cycle.push_back(canvas.mesh().source(h));
  }
  return cycle;
}

double loop_cost(const TurnMeter& meter, const std::vector<VertexId>& loop,
                 const TurningPrice& price) {
  double length = 0.0;
  for (const HalfedgeId h : edges_of(meter.canvas(), loop)) length += meter.canvas().length(h);
  return price.cost(length, meter.turn(loop));
}

void straighten_loops(Canvas& canvas, const TurnMeter& meter, const TurningPrice& price,
                      std::span<std::vector<VertexId>> loops, const ExecutionContext& context) {
  for (int round = 0; round < kRounds; ++round) {
    bool changed = false;
    for (std::vector<VertexId>& loop : loops) {
      if (std::abs(meter.turn(loop)) < kStraight) continue;
      const double now = loop_cost(meter, loop, price);
      std::vector<VertexId> cycle = crossing_cycle(meter, loop, price, now, context);
      if (cycle.empty()) continue;
      canvas.erase(edges_of(canvas, loop));
      canvas.draw(edges_of(canvas, cycle), Curve::kLoop);
      loop = std::move(cycle);
      changed = true;
    }
    if (!changed) return;
  }
}

}  // namespace flipfree::seamless
