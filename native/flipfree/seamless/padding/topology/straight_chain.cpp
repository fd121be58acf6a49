#include "flipfree/seamless/padding/topology/straight_chain.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/paths/free_distances.h"
#include "flipfree/seamless/padding/straight/hole_tour.h"
#include "flipfree/seamless/padding/straight/straight_loops.h"
#include "flipfree/seamless/padding/topology/hole_chain.h"
#include "flipfree/seamless/padding/topology/short_loops.h"

namespace flipfree::seamless {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
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

double mean_length(const Canvas& canvas, const std::vector<std::vector<VertexId>>& loops) {
  double sum = 0.0;
  for (const std::vector<VertexId>& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i)
      sum += canvas.length(canvas.mesh().find(loop[i], loop[(i + 1) % loop.size()]));
  }
  return sum / static_cast<double>(loops.size());
}

}  // namespace

HoleFrames::HoleFrames(const TurnMeter& meter, const std::vector<std::vector<VertexId>>& loops)
    : meter_(meter), places_(2 * loops.size()) {
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

namespace {

// Loops, drawn; their holes, in an order, and how to find ways between them.
class StraightChain {
 public:
  StraightChain(const StraightChain&) = delete;  // the price knows where its ways are counted
  StraightChain& operator=(const StraightChain&) = delete;

  // `first`: the loop whose holes the chain begins and ends with, which is drawn already; or empty.
  StraightChain(Canvas& canvas, std::vector<VertexId> first, Index genus,
                const Straightness& straight, const ExecutionContext& context)
      : canvas_(canvas),
        context_(context),
        meter_(canvas, straight.crossings),
        loops_(draw_loops(canvas, first, genus, context)),
        ways_left_(std::min(kMostWays, kWaysPerVertex * canvas.vertex_count())),
        price_{straight.quarter_price * mean_length(canvas, loops_), &ways_left_},
        holes_(canvas, straightened(first.empty() ? 0 : 1)),
        frames_(meter_, loops_),
        most_vertices_(kMostRefined * canvas.vertex_count()) {}

  const Holes& holes() const { return holes_; }

  // A short tour, with an odd couple where that is asked for.
  std::vector<Index> tour(bool odd_couple) const {
    if (holes_.count() == 2) return {0, 1};
    return hole_tour(connector_costs(meter_, holes_, frames_, price_, context_), odd_couple,
                     context_);
  }

  ConnectorFinder finder() const {
    return
        [this](const std::vector<HalfedgeId>& from, Index hole,
               const std::function<bool(VertexId)>& allowed) { return way(from, hole, allowed); };
  }

 private:
  static std::vector<std::vector<VertexId>> draw_loops(Canvas& canvas,
                                                       const std::vector<VertexId>& first,
                                                       Index genus,
                                                       const ExecutionContext& context) {
    std::vector<std::vector<VertexId>> drawn;
    if (!first.empty()) drawn.push_back(first);
    return draw_short_loops(canvas, genus, std::move(drawn), nullptr, context);
  }

  const std::vector<std::vector<VertexId>>& straightened(std::size_t kept) {
    straighten_loops(canvas_, meter_, price_, std::span(loops_).subspan(kept), context_);
    return loops_;
  }

  std::vector<HalfedgeId> way(const std::vector<HalfedgeId>& from, Index hole,
                              const std::function<bool(VertexId)>& allowed) const {
    if (canvas_.vertex_count() > most_vertices_) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "Connectors that turn little wind around each other.");
    }
    std::vector<HalfedgeId> last;
    for (const VertexId v : loops_[at(hole / 2)]) {
      if (!allowed(v)) continue;
      for (const HalfedgeId sector : holes_.sectors_at(hole, v))
        canvas_.for_each_inside(sector, [&](HalfedgeId h) { last.push_back(h); });
    }
    const std::vector<double> left = free_distances(canvas_, last, kInvalid, context_).distance;
    double least = kInfinity;
    std::vector<HalfedgeId> path;
    for (const std::int64_t sheets : {TurningSearch::kSheets, 4 * TurningSearch::kSheets}) {
      TurningSearch search(meter_, left, sheets);
      for (const HalfedgeId sector : from) {
        const Index here = holes_.hole_of(sector);
        canvas_.for_each_inside(sector,
                                [&](HalfedgeId h) { search.start(h, frames_.deviation(here, h)); });
      }
      search.run(
          [&](const TurningSearch::Arrival& arrival) {
            const HalfedgeId back = canvas_.mesh().opposite(arrival.halfedge);
            if (holes_.loop_of(canvas_.mesh().source(back)) != hole / 2 ||
                !allowed(canvas_.mesh().source(back)) || !holes_.has(hole, canvas_.sector_of(back)))
              return;
            const double cost =
                price_.cost(arrival.length, arrival.turned - frames_.deviation(hole, back));
            if (cost >= least) return;
            least = cost;
            path = search.path(arrival);
          },
          [&] { return least; }, price_.ways_left, context_);
      if (!path.empty()) break;
    }
    return path;
  }

  Canvas& canvas_;
  const ExecutionContext& context_;
  const TurnMeter meter_;
  std::vector<std::vector<VertexId>> loops_;
  std::int64_t ways_left_;
  const TurningPrice price_;
  const Holes holes_;
  const HoleFrames frames_;
  const Index most_vertices_;
};

}  // namespace

void draw_straight_chain(Canvas& canvas, Index genus, const Straightness& straight,
                         const ExecutionContext& context) {
  const StraightChain chain(canvas, {}, genus, straight, context);
  draw_connectors(canvas, chain.holes(), chain.tour(genus > 2), chain.finder(), context);
}

std::array<VertexId, 2> draw_straight_chain_with_t_nodes(Canvas& canvas, Index genus,
                                                         const Straightness& straight,
                                                         const ExecutionContext& context) {
  const StraightChain chain(canvas, {}, genus, straight, context);
  return draw_connectors_with_t_nodes(canvas, chain.holes(), chain.tour(false), chain.finder(),
                                      context);
}

std::array<VertexId, 2> draw_straight_twisted_chain(Canvas& canvas,
                                                    const std::vector<VertexId>& first, Index genus,
                                                    const Straightness& straight,
                                                    const ExecutionContext& context) {
  const StraightChain chain(canvas, first, genus, straight, context);
  std::vector<Index> order = {0, 1};
  if (genus > 1) {
    order =
        hole_order(chain.holes().count(), hole_neighbours(canvas, chain.holes(), context), false);
  }
  return draw_twisted_connectors(canvas, chain.holes(), order, chain.finder(), context);
}

}  // namespace flipfree::seamless
