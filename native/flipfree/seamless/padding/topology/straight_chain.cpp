#include "flipfree/seamless/padding/topology/straight_chain.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/topology/hole_chain.h"
#include "flipfree/seamless/padding/topology/paths/free_distances.h"
#include "flipfree/seamless/padding/topology/short_loops.h"
#include "flipfree/seamless/padding/topology/straight/hole_tour.h"
#include "flipfree/seamless/padding/topology/straight/straight_loops.h"

namespace flipfree::seamless {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A quarter turn that a curve misses is worth so many loops' lengths.
constexpr double kQuarterPrice = 3.0;
// Searches end when so many other holes were reached, and cannot be reached for less.
constexpr std::size_t kMostReached = 10;
// Ways that all searches together look at: twice what surfaces take whose cones lie beside their
// handles. Where no cone is near, no way around one makes a curve turn less.
constexpr std::int64_t kMostWays = 20'000'000;
constexpr std::int64_t kWaysPerVertex = 2000;
// Times what the loops leave, in vertices. Connectors that refine further wind around each other.
constexpr Index kMostRefined = 3;
// Of ways over other holes.
constexpr double kDetour = 1.5;
// Above, closing the costs over other holes takes longer than the cut itself.
constexpr std::size_t kMostClosed = 800;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

double mean_length(const Canvas& canvas, const std::vector<std::vector<VertexId>>& loops) {
  double sum = 0.0;
  for (const std::vector<VertexId>& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i)
      sum += canvas.length(canvas.mesh().find(loop[i], loop[(i + 1) % loop.size()]));
  }
  return sum / static_cast<double>(loops.size());
}

}  // namespace

HoleFrames::HoleFrames(const TurnMeter& meter, const Holes& holes,
                       const std::vector<std::vector<VertexId>>& loops)
    : meter_(meter), holes_(holes), places_(2 * loops.size()) {
  const Canvas& canvas = meter.canvas();
  for (std::size_t hole = 0; hole < places_.size(); ++hole) {
    std::vector<VertexId> loop = loops[hole / 2];
    if (hole % 2 == 1) std::reverse(loop.begin(), loop.end());
    const std::size_t n = loop.size();
    std::vector<HalfedgeId> edge;
    for (std::size_t i = 0; i < n; ++i)
      edge.push_back(canvas.mesh().find(loop[i], loop[(i + 1) % n]));
    // Where each edge heads, from where the first does, and where it begins.
    std::vector<double> heading = {0.0}, start = {0.0};
    for (std::size_t i = 1; i < n; ++i) {
      heading.push_back(heading.back() + meter.turn(edge[i - 1], edge[i]));
      start.push_back(start.back() + canvas.length(edge[i - 1]));
    }
    const double length = start.back() + canvas.length(edge.back());
    const double slope = (heading.back() + meter.turn(edge.back(), edge.front())) / length;
    double mean = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double own = canvas.length(edge[i]);
      mean += (heading[i] - slope * (start[i] + 0.5 * own)) * own / length;
    }
    for (std::size_t i = 0; i < n; ++i) {
      const double offset = heading[i] - (mean + slope * start[i]) - TurnMeter::kQuarter;
      places_[hole].push_back({loop[i], {loop[(i + 1) % n], offset}});
    }
    std::sort(places_[hole].begin(), places_[hole].end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
  }
}

double HoleFrames::deviation(Index hole, HalfedgeId departure) const {
  const Canvas& canvas = meter_.canvas();
  const VertexId v = canvas.mesh().source(departure);
  const auto& places = places_[at(hole)];
  const auto place =
      std::lower_bound(places.begin(), places.end(), v,
                       [](const auto& entry, VertexId vertex) { return entry.first < vertex; });
  if (place == places.end() || place->first != v)
    throw InternalError("a connector that is not at its hole");
  const HalfedgeId along = canvas.mesh().find(v, place->second.next);
  return place->second.offset + meter_.angle_between(along, departure);
}

std::vector<std::vector<double>> connector_costs(const TurnMeter& meter, const Holes& holes,
                                                 const HoleFrames& frames,
                                                 const TurningPrice& price,
                                                 const ExecutionContext& context) {
  const Canvas& canvas = meter.canvas();
  const std::size_t count = at(holes.count());
  std::vector<std::vector<double>> cost(count, std::vector<double>(count, kInfinity));
  for (std::size_t hole = 0; hole < count; ++hole) {
    context.check();
    const auto from = static_cast<Index>(hole);
    TurningSearch search(meter);
    for (const HalfedgeId sector : holes.open_sectors(from)) {
      canvas.for_each_inside(sector,
                             [&](HalfedgeId h) { search.start(h, frames.deviation(from, h)); });
    }
    std::vector<double> found(count, kInfinity);
    double limit = kInfinity;
    search.run(
        [&](const TurningSearch::Arrival& arrival) {
          const HalfedgeId back = canvas.mesh().opposite(arrival.halfedge);
          const Index to = holes.hole_of(canvas.sector_of(back));
          if (to == from) return;
          const double now =
              price.cost(arrival.length, arrival.turned - frames.deviation(to, back));
          if (now >= found[at(to)]) return;
          found[at(to)] = now;
          std::vector<double> sorted = found;
          const std::size_t last = std::min(kMostReached, count - 1) - 1;
          std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(last),
                           sorted.end());
          limit = sorted[last];
        },
        [&] { return limit; }, price.ways_left, context);
    for (std::size_t to = 0; to < count; ++to) {
      cost[hole][to] = std::min(cost[hole][to], found[to]);
      cost[to][hole] = cost[hole][to];
    }
  }
  for (std::size_t hole = 0; hole < count; ++hole) cost[hole][hole] = 0.0;
  std::vector<std::vector<double>> over = cost;
  for (std::size_t k = 0; k < count && count <= kMostClosed; ++k) {
    context.check();
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j)
        over[i][j] = std::min(over[i][j], over[i][k] + over[k][j]);
    }
  }
  double largest = 0.0;
  for (const auto& row : over) {
    for (const double c : row) {
      if (c < kInfinity) largest = std::max(largest, c);
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      if (cost[i][j] == kInfinity)
        cost[i][j] = kDetour * (over[i][j] < kInfinity ? over[i][j] : largest);
    }
  }
  return cost;
}

void draw_straight_chain(Canvas& canvas, Index genus, const std::vector<double>& crossings,
                         const ExecutionContext& context) {
  const TurnMeter meter(canvas, crossings);
  std::vector<std::vector<VertexId>> loops = draw_short_loops(canvas, genus, {}, nullptr, context);
  std::int64_t ways = std::min(kMostWays, kWaysPerVertex * canvas.vertex_count());
  const TurningPrice price{kQuarterPrice * mean_length(canvas, loops), &ways};
  straighten_loops(canvas, meter, price, loops, context);
  const Holes holes(canvas, loops);
  const HoleFrames frames(meter, holes, loops);
  const std::vector<Index> order =
      hole_tour(connector_costs(meter, holes, frames, price, context), genus > 2, context);
  const Index most_vertices = kMostRefined * canvas.vertex_count();
  const ConnectorFinder finder = [&](const std::vector<HalfedgeId>& from, Index hole,
                                     const std::function<bool(VertexId)>& allowed) {
    if (canvas.vertex_count() > most_vertices) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "Connectors that turn little wind around each other.");
    }
    std::vector<HalfedgeId> last;
    for (const VertexId v : loops[at(hole / 2)]) {
      if (!allowed(v)) continue;
      for (const HalfedgeId sector : holes.sectors_at(hole, v))
        canvas.for_each_inside(sector, [&](HalfedgeId h) { last.push_back(h); });
    }
    const std::vector<double> left = free_distances(canvas, last, kInvalid, context).distance;
    double least = kInfinity;
    std::vector<HalfedgeId> path;
    for (const std::int64_t sheets : {TurningSearch::kSheets, 4 * TurningSearch::kSheets}) {
      TurningSearch search(meter, left, sheets);
      for (const HalfedgeId sector : from) {
        const Index here = holes.hole_of(sector);
        canvas.for_each_inside(sector,
                               [&](HalfedgeId h) { search.start(h, frames.deviation(here, h)); });
      }
      search.run(
          [&](const TurningSearch::Arrival& arrival) {
            const HalfedgeId back = canvas.mesh().opposite(arrival.halfedge);
            if (holes.loop_of(canvas.mesh().source(back)) != hole / 2 ||
                !allowed(canvas.mesh().source(back)) || !holes.has(hole, canvas.sector_of(back)))
              return;
            const double cost =
                price.cost(arrival.length, arrival.turned - frames.deviation(hole, back));
            if (cost >= least) return;
            least = cost;
            path = search.path(arrival);
          },
          [&] { return least; }, price.ways_left, context);
      if (!path.empty()) break;
    }
    return path;
  };
  draw_connectors(canvas, holes, order, finder, context);
}

}  // namespace flipfree::seamless
