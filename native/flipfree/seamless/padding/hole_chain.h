// The curves that cut a surface into one disk: short loops, and connectors between the holes that
// they make (thesis 5.3.1, 5.4.1), led by a field or by the cones (6.5.1).
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "flipfree/seamless/padding/paths.h"

namespace flipfree::seamless {

// By how many quarters a map is to turn along a cycle of vertices.
using CycleTurns = std::function<Index(const std::vector<VertexId>& cycle)>;

// What curves are led by.
struct ChainGuide {
  // Of loops that are not much longer than others, those that are to turn least are taken (thesis
  // 6.5.1.1); null: the shortest.
  CycleTurns turning = nullptr;
  // Angles in which connectors pay for what they miss of the right angles to the loops' mean
  // directions at both their ends (thesis 6.5.1.2): flat_crossings() of the canvas' surface, or
  // others in which it is flat but for its cones. Null: they are as short as they can be.
  const std::vector<double>* crossings = nullptr;
  // What a quarter turn that a connector misses costs, in mean lengths of the loops.
  double quarter_price = 0.0;
};

// A hole chain: connectors from hole to hole, in an order whose ends are partners, that leave a
// hole elsewhere than they reach it, and reach its partner where they left it: all nodes have
// degree four, 2 genus - 1 of them. Holes are the two sides of each loop, partners of each other.
// From three loops on with an odd couple: two partners between which there is an odd number of
// holes.
//
//     .--.       .--.       .--.           q, q': where the chain comes and goes. The hole's
//  ---q  q'------q  q'------q  q'---       partner has q where it goes and q' where it comes: the
//     '--'       '--'       '--'           side of the loop that is on the chain's left at one is
//                                          on its left at the other.
//
// The loops are short, disjoint, and no sum of them bounds: cycles of a tree of shortest paths and
// a cotree (Eppstein 2003; Erickson, Whittlesey 2005). Precondition: nothing is drawn. Throws
// NotConverged where a curve is not found. Cost: O(#F log #F) a curve; with a guide a fixed number
// of steps more.
void draw_hole_chain(Canvas& canvas, Index genus, const ChainGuide& guide = {});

// The same with two T-nodes, which a further path can join: the first connector leaves the hole on
// the left of `first`, and the last one reaches its partner elsewhere. `first`: a loop that is
// drawn already, its vertices in order, and nothing else is; it does not separate. Returns the
// T-nodes.
//
// Joined from a corner to a corner with half of all other corners between them, all nodes have
// right angles, and a loop turns by an odd number of quarters if and only if it crosses `first` an
// odd number of times (two of the nine ways to join them; the others, where parts fit: otherwise).
std::array<VertexId, 2> draw_twisted_chain(Canvas& canvas, const std::vector<VertexId>& first,
                                           Index genus, const ChainGuide& guide = {});

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
                                                const ChainGuide& guide = {});

}  // namespace flipfree::seamless
