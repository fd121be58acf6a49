#include "flipfree/seamless/padding/straight/straight_loops.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "flipfree/seamless/padding/paths/free_distances.h"

namespace flipfree::seamless {
namespace {

// A loop that turns by less than this is straight.
constexpr double kStraight = 0.5 * TurnMeter::kQuarter;
constexpr int kStraighteningRounds = 4;
// Distances to all vertices take as long as one way for so many of them.
constexpr Index kWaysPerDistance = 4;
// Of a loop's cost: what the first search for another one may cost, and how much more each next.
constexpr double kFirstSearchShare = 1.0 / 32.0;
constexpr double kMoreShare = 2.0;

}  // namespace

std::vector<VertexId> crossing_cycle(const TurnMeter& meter, const std::vector<VertexId>& loop,
                                     const TurningPrice& price, double most,
                                     const ExecutionContext& context) {
  const Canvas& canvas = meter.canvas();
  const std::size_t n = loop.size();
  double least = most;
  std::vector<VertexId> cycle;
  std::vector<HalfedgeId> last;
  for (std::size_t i = 0; i < n; ++i) {
    canvas.for_each_inside(canvas.mesh().find(loop[i], loop[(i + n - 1) % n]),
                           [&](HalfedgeId h) { last.push_back(h); });
  }
  if (price.ways_left != nullptr) *price.ways_left -= canvas.vertex_count() / kWaysPerDistance;
  const std::vector<double> left_over = free_distances(canvas, last, kInvalid, context).distance;
  for (std::size_t i = 0; i < n; ++i) {
    context.check();
    const HalfedgeId left = canvas.mesh().find(loop[i], loop[(i + 1) % n]);
    const HalfedgeId right = canvas.mesh().find(loop[i], loop[(i + n - 1) % n]);
    TurningSearch search(meter, left_over);
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
        [&] { return least; }, price.ways_left, context);
    if (path.empty()) continue;
    cycle.clear();
    for (const HalfedgeId h : path) cycle.push_back(canvas.mesh().source(h));
  }
  return cycle;
}

double loop_cost(const TurnMeter& meter, const std::vector<VertexId>& loop,
                 const TurningPrice& price) {
  double length = 0.0;
  for (const HalfedgeId h : meter.canvas().edges_of(loop)) length += meter.canvas().length(h);
  return price.cost(length, meter.turn(loop));
}

void straighten_loops(Canvas& canvas, const TurnMeter& meter, const TurningPrice& price,
                      std::span<std::vector<VertexId>> loops, const ExecutionContext& context) {
  // What crosses a new loop runs beside the old one: perhaps on the other side of a cone.
  std::vector<char> is_new(loops.size(), 0);
  for (int round = 0; round < kStraighteningRounds; ++round) {
    bool changed = false;
    for (std::size_t i = 0; i < loops.size(); ++i) {
      std::vector<VertexId>& loop = loops[i];
      if (is_new[i] == 0 && std::abs(meter.turn(loop)) < kStraight) continue;
      is_new[i] = 0;
      const double now = loop_cost(meter, loop, price);
      // What is found for little needs no search far around.
      std::vector<VertexId> cycle;
      for (double most = kFirstSearchShare * now; cycle.empty() && most < kMoreShare * now;
           most *= kMoreShare)
        cycle = crossing_cycle(meter, loop, price, std::min(most, now), context);
      if (cycle.empty()) continue;
      canvas.erase(canvas.edges_of(loop));
      canvas.draw(canvas.edges_of(cycle), Curve::kLoop);
      loop = std::move(cycle);
      is_new[i] = 1;
      changed = true;
    }
    if (!changed) return;
  }
}

}  // namespace flipfree::seamless
