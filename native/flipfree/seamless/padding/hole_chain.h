// The curves that cut a surface into one disk: short loops, and connectors between the holes that
// they make (thesis 5.3.1).
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths.h"
#include "flipfree/seamless/padding/straight.h"

namespace flipfree::seamless {

// The holes that cutting along disjoint loops makes, two per loop, and a way to string them up
// (thesis 5.3.1, 5.4.1).
//
// Hole 2 l is on the left of loop l, hole 2 l + 1 on its right: partners.

class Holes {
 public:
  // `loops`: vertices in order, drawn. Their edges must not be split while this is used.
  Holes(const Canvas& canvas, std::vector<std::vector<VertexId>> loops);

  Index count() const { return 2 * static_cast<Index>(loops_.size()); }
  // Sectors of a vertex of the loop on the hole's side, counter-clockwise: one, and one more per
  // connector that ends there.
  std::vector<HalfedgeId> sectors_at(Index hole, VertexId v) const;
  // Those of all vertices of the loop that no connector has reached from either side.
  std::vector<HalfedgeId> open_sectors(Index hole) const;
  // Is this sector, of a vertex of the loop, on the hole's side?
  bool has(Index hole, HalfedgeId sector) const;
  // The hole on whose side this sector of a loop's vertex is.
  Index hole_of(HalfedgeId sector) const;
  bool is_open(VertexId v) const { return canvas_.drawn_around(v).size() == 2; }
  Index loop_of(VertexId v) const;

 private:
  VertexId neighbour(VertexId v, Index step) const;

  const Canvas& canvas_;
  std::vector<std::vector<VertexId>> loops_;
  std::vector<std::array<Index, 2>> where_;  // per vertex when this was made: loop, number in it
};

// A distance from hole to hole.
struct HolePair {
  Index a, b;
  double distance;
};
// Of holes that are neighbours: a path from one to the other meets no third one's surroundings.
// Cost: O(#F log #F).
std::vector<HolePair> hole_neighbours(const Canvas& canvas, const Holes& holes,
                                      const ExecutionContext& context);

// All holes in an order in which one is near the one before; the first and the last are partners.
// odd_couple: with two partners between which there is an odd number of holes, which takes three
// loops or more. Cost: O(count^2 log count).
std::vector<Index> hole_order(Index count, const std::vector<HolePair>& neighbours,
                              bool odd_couple);

// Short disjoint loops that open all handles of a surface (thesis 5.4.1).
//
// Tree and cotree (Eppstein 2003; Erickson, Whittlesey 2005) over the free vertices: the tree has
// the shortest paths from a root, the cotree crosses edges by falling length of the cycle that they
// close in the tree. The edges that are left close cycles that are independent in homology, so any
// of them that are disjoint leave the surface connected when it is cut along them.

// By how many quarters a map is to turn along a cycle of vertices.
using CycleTurns = std::function<Index(const std::vector<VertexId>& cycle)>;

// Draws loops through free vertices until there are `genus` of them; returns the vertices of each
// in order. `drawn`: those that are there already, disjoint and independent; nothing else is.
// `wished`: of loops that are not much longer than others, those that are to turn least are taken
// (thesis 6.5.1.1); null: the shortest. Cost: O(#F log #F) a round; a round finds the shortest loop
// of its tree and those that are disjoint and not much longer.
std::vector<std::vector<VertexId>> draw_short_loops(Canvas& canvas, Index genus,
                                                    std::vector<std::vector<VertexId>> drawn,
                                                    const CycleTurns& wished,
                                                    const ExecutionContext& context);

// A hole chain: connectors from hole to hole, in an order whose ends are partners, that leave a
// hole elsewhere than they reach it, and reach its partner where they left it: all nodes have
// degree four, 2 genus - 1 of them. From three loops on with an odd couple: two partners between
// which there is an odd number of holes.
//
//     .--.       .--.       .--.           q, q': where the chain comes and goes. The hole's
//  ---q  q'------q  q'------q  q'---       partner has q where it goes and q' where it comes: the
//     '--'       '--'       '--'           side of the loop that is on the chain's left at one is
//                                          on its left at the other.
//
// Precondition: nothing is drawn. `wished`: as for draw_short_loops(). Cost: O(#F log #F) a curve.
void draw_hole_chain(Canvas& canvas, Index genus, const ExecutionContext& context,
                     const CycleTurns& wished = nullptr);

// The path of a connector from one of the sectors, which are of one hole, to another hole, to a
// vertex that is allowed, through free vertices; empty if there is none.
using ConnectorFinder = std::function<std::vector<HalfedgeId>(
    const std::vector<HalfedgeId>& from, Index hole, const std::function<bool(VertexId)>& allowed)>;

// The chains' connectors alone: `holes` of loops that are drawn, in an order as hole_order() gives
// one; null: the shortest connectors. The twisted chain's order begins with hole 0, that on the
// left of its first loop.
void draw_connectors(Canvas& canvas, const Holes& holes, const std::vector<Index>& order,
                     const ConnectorFinder& finder, const ExecutionContext& context);

// The same with two T-nodes, which a further path can join: the first connector leaves the hole on
// the left of `first`, and the last one reaches its partner elsewhere. `first`: a loop that is
// drawn already, its vertices in order, and nothing else is; it does not separate. Returns the
// T-nodes.
//
// Joined from a corner to a corner with half of all other corners between them, all nodes have
// right angles, and a loop turns by an odd number of quarters if and only if it crosses `first` an
// odd number of times (two of the nine ways to join them; the others, where parts fit: otherwise).
std::array<VertexId, 2> draw_twisted_chain(Canvas& canvas, const std::vector<VertexId>& first,
                                           Index genus, const ExecutionContext& context,
                                           const CycleTurns& wished = nullptr);
std::array<VertexId, 2> draw_twisted_connectors(Canvas& canvas, const Holes& holes,
                                                const std::vector<Index>& order,
                                                const ConnectorFinder& finder,
                                                const ExecutionContext& context);

// For genus 1 and 2: the same with two T-nodes, which a further path can join.
//
//   genus 1: the connector reaches its hole at another place than it left the partner;
//   genus 2: holes 0, 2, 3, 1. The first connector ends where the second begins, on the same
//            side of loop 1; the second ends and the third begins elsewhere, in the T-nodes.
//
// Every path from a sector of one T-node to a sector of the other one leaves four branches at all
// nodes, and parts with 2 and 6 corners or 4 and 4 (genus 1), with 2, 3, 5, 6, 7 and the rest to
// 16, or 4 and 12 (genus 2). Precondition: nothing is drawn. Returns the T-nodes.
std::array<VertexId, 2> draw_chain_with_t_nodes(Canvas& canvas, Index genus,
                                                const ExecutionContext& context,
                                                const CycleTurns& wished = nullptr);
std::array<VertexId, 2> draw_connectors_with_t_nodes(Canvas& canvas, const Holes& holes,
                                                     const std::vector<Index>& order,
                                                     const ConnectorFinder& finder,
                                                     const ExecutionContext& context);

// A hole chain that turns little in the flat angles of the surface, so that the metric of the disk
// that it leaves is not far from the disk's own.
//
// Straight segments between right angles turn by nothing. Loops that turn are exchanged
// (straight_loops.h); connectors pay for what they miss of the right angles to the loops' mean
// directions at both their ends (turning_path.h); and the order of the holes is a tour over what
// these would cost (hole_tour.h).

// Which way is straight ahead from a hole: at right angles to its loop, as that would run if it
// turned evenly all along.
class HoleFrames {
 public:
  // `loops`: hole 2 l is on the left of loop l, hole 2 l + 1 on its right; `meter`'s canvas has
  // them drawn.
  HoleFrames(const TurnMeter& meter, const std::vector<std::vector<VertexId>>& loops);

  // How far to the left of that a half-edge heads which leaves the hole's loop on the hole's side.
  double deviation(Index hole, HalfedgeId departure) const;

 private:
  const TurnMeter& meter_;
  struct Place {
    VertexId next = kInvalid;  // along the loop, the hole on the left
    double offset = 0.0;       // of the edge to it, from straight ahead
  };
  std::vector<std::vector<std::pair<VertexId, Place>>> places_;  // per hole, by vertex
};

// What a connector from each hole to each other one would cost, before any is drawn. Those that are
// not found, because others are nearer, cost what a way over others does and more. Symmetric. Cost:
// one search per hole.
std::vector<std::vector<double>> connector_costs(const TurnMeter& meter, const Holes& holes,
                                                 const HoleFrames& frames,
                                                 const TurningPrice& price,
                                                 const ExecutionContext& context);

// What a chain is to be straight in, and what that is worth.
struct Straightness {
  // flat_crossings() of the canvas' surface, or others in which it is flat but for its cones.
  const std::vector<double>& crossings;
  // Of a quarter turn that a curve misses, in mean lengths of the loops.
  double quarter_price;
};

// As draw_hole_chain(), genus 2 and more; draw_chain_with_t_nodes(); draw_twisted_chain()
// (hole_chain.h).
void draw_straight_chain(Canvas& canvas, Index genus, const Straightness& straight,
                         const ExecutionContext& context);
std::array<VertexId, 2> draw_straight_chain_with_t_nodes(Canvas& canvas, Index genus,
                                                         const Straightness& straight,
                                                         const ExecutionContext& context);
std::array<VertexId, 2> draw_straight_twisted_chain(Canvas& canvas,
                                                    const std::vector<VertexId>& first, Index genus,
                                                    const Straightness& straight,
                                                    const ExecutionContext& context);

}  // namespace flipfree::seamless
