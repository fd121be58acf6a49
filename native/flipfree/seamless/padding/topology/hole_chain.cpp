#include "flipfree/seamless/padding/topology/hole_chain.h"

#include <cstddef>
#include <functional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/paths/free_path.h"

namespace flipfree::seamless {
namespace {

struct Ends {
  VertexId from = kInvalid;
  VertexId to = kInvalid;
};

// Draws connectors between holes.
class Connector {
 public:
  Connector(Canvas& canvas, const Holes& holes, const ExecutionContext& context,
            ConnectorFinder finder = nullptr)
      : canvas_(canvas), holes_(holes), context_(context), finder_(std::move(finder)) {}

  // The finder's way, or the shortest one, from one of the sectors to `hole`, to a vertex that is
  // allowed.
  std::vector<HalfedgeId> find(const std::vector<HalfedgeId>& from, Index hole,
                               const std::function<bool(VertexId)>& allowed) const {
    const auto is_end = [&](HalfedgeId sector) {
      return allowed(canvas_.mesh().source(sector)) && holes_.has(hole, sector);
    };
    std::vector<HalfedgeId> path;
    if (finder_) path = finder_(from, hole, allowed);
    if (path.empty()) path = free_path(canvas_, {from, {}}, {is_end, nullptr}, context_);
    if (path.empty()) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "The cut found no connector to hole " + std::to_string(hole) +
                              " of the surface cut along short loops. Refine the mesh.");
    }
    return path;
  }

  Ends ends(const std::vector<HalfedgeId>& path) const {
    return {canvas_.mesh().source(path.front()), canvas_.mesh().target(path.back())};
  }

  Ends draw(const std::vector<HalfedgeId>& from, Index hole,
            const std::function<bool(VertexId)>& allowed) {
    const std::vector<HalfedgeId> path = find(from, hole, allowed);
    const Ends result = ends(path);
    canvas_.draw(path, Curve::kConnector);
    return result;
  }

 private:
  Canvas& canvas_;
  const Holes& holes_;
  const ExecutionContext& context_;
  const ConnectorFinder finder_;
};

// Where the chain comes to a loop and goes on from it, on the hole that it visits first.
struct Visit {
  Index hole = kInvalid;
  VertexId come = kInvalid;
  VertexId go = kInvalid;
};

// From a hole to its partner, where they are neighbours in the chain: the same place on both.
VertexId draw_straight_connector(Connector& connector, const Holes& holes, Index hole) {
  const auto is_open = [&](VertexId v) { return holes.is_open(v); };
  const Index partner = partner_of(hole);
  // Near to where the shortest way between any two of their vertices ends.
  const VertexId v = connector.ends(connector.find(holes.open_sectors(hole), partner, is_open)).to;
  connector.draw(holes.sectors_at(hole, v), partner, [v](VertexId w) { return w == v; });
  return v;
}

// From the only hole to its partner, to another place.
std::array<VertexId, 2> draw_askew_connector(Connector& connector, const Holes& holes) {
  const auto anywhere = [](VertexId) { return true; };
  const VertexId from = connector.ends(connector.find(holes.open_sectors(0), 1, anywhere)).from;
  const VertexId to =
      connector.draw(holes.sectors_at(0, from), 1, [from](VertexId v) { return v != from; }).to;
  return {from, to};
}

// Connectors from hole to hole. `twisted`: the last one ends elsewhere than the first one began.
// Returns where these two places are.
std::array<VertexId, 2> string_up(Connector& connector, const Holes& holes,
                                  const std::vector<Index>& order, bool twisted) {
  std::vector<Visit> visits(order.size() / 2);
  VertexId end = kInvalid;
  for (std::size_t i = 0; i + 1 < order.size(); ++i) {
    const Index here = order[i];
    const Index next = order[i + 1];
    Visit& leaving = visits[at(here / 2)];
    if (next == partner_of(here)) {
      leaving.hole = here;
      leaving.go = draw_straight_connector(connector, holes, here);
      continue;
    }
    Visit& reaching = visits[at(next / 2)];
    const bool back =
        leaving.hole == partner_of(here);  // the partner's places, the other way round
    const std::vector<HalfedgeId> from =
        back ? holes.sectors_at(here, leaving.come) : holes.open_sectors(here);
    // Also the last connector, to the partner of the first hole, ends where the first one began.
    const bool met = reaching.hole == partner_of(next) && !(twisted && next == order.back());
    const Ends ends = connector.draw(
        from, next, [&](VertexId v) { return met ? v == reaching.go : holes.is_open(v); });
    end = ends.to;
    if (!back) {
      leaving.hole = here;
      leaving.go = ends.from;
    }
    if (!met) {
      reaching.hole = next;
      reaching.come = ends.to;
    }
  }
  return {visits[at(order.front() / 2)].go, end};
}

}  // namespace

void draw_hole_chain(Canvas& canvas, Index genus, const ExecutionContext& context,
                     const CycleTurns& wished) {
  const Holes holes(canvas, draw_short_loops(canvas, genus, {}, wished, context));
  draw_connectors(canvas, holes,
                  hole_order(holes.count(), hole_neighbours(canvas, holes, context), genus > 2),
                  nullptr, context);
}

void draw_connectors(Canvas& canvas, const Holes& holes, const std::vector<Index>& order,
                     const ConnectorFinder& finder, const ExecutionContext& context) {
  Connector connector(canvas, holes, context, finder);
  string_up(connector, holes, order, false);
}

std::array<VertexId, 2> draw_twisted_chain(Canvas& canvas, const std::vector<VertexId>& first,
                                           Index genus, const ExecutionContext& context,
                                           const CycleTurns& wished) {
  const Holes holes(canvas, draw_short_loops(canvas, genus, {first}, wished, context));
  std::vector<Index> order = {0, 1};
  if (genus > 1) order = hole_order(holes.count(), hole_neighbours(canvas, holes, context), false);
  return draw_twisted_connectors(canvas, holes, order, nullptr, context);
}

std::array<VertexId, 2> draw_twisted_connectors(Canvas& canvas, const Holes& holes,
                                                const std::vector<Index>& order,
                                                const ConnectorFinder& finder,
                                                const ExecutionContext& context) {
  Connector connector(canvas, holes, context, finder);
  if (order.size() == 2) return draw_askew_connector(connector, holes);
  return string_up(connector, holes, order, true);
}

std::array<VertexId, 2> draw_chain_with_t_nodes(Canvas& canvas, Index genus,
                                                const ExecutionContext& context,
                                                const CycleTurns& wished) {
  const Holes holes(canvas, draw_short_loops(canvas, genus, {}, wished, context));
  const std::vector<Index> order = genus == 1 ? std::vector<Index>{0, 1} : std::vector{0, 2, 3, 1};
  return draw_connectors_with_t_nodes(canvas, holes, order, nullptr, context);
}

std::array<VertexId, 2> draw_connectors_with_t_nodes(Canvas& canvas, const Holes& holes,
                                                     const std::vector<Index>& order,
                                                     const ConnectorFinder& finder,
                                                     const ExecutionContext& context) {
  Connector connector(canvas, holes, context, finder);
  if (order.size() == 2) return draw_askew_connector(connector, holes);
  const auto is_open = [&](VertexId v) { return holes.is_open(v); };
  const Ends first = connector.draw(holes.open_sectors(order[0]), order[1], is_open);
  const Ends second = connector.draw(holes.sectors_at(order[1], first.to), order[2], is_open);
  const Ends third = connector.draw(holes.open_sectors(order[2]), order[3],
                                    [&](VertexId v) { return v == first.from; });
  return {second.to, third.from};
}

}  // namespace flipfree::seamless
