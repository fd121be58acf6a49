// Cuts whose loops turn as they are asked to (thesis 6.5.2, 6.5.3): branches are taken around cones
// until every loop of a homology basis does; then all loops do (quasi-additivity, thesis 6.2).
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/paths.h"

namespace flipfree::seamless {

// The curves on a canvas as a graph of branches from node to node, and loops of it that generate
// the surface's homology (thesis 6.5.2).

// Branch b has two ends, 2 b at its first vertex and 2 b + 1 at its last. A branch as it is walked
// along is named by the end at which that begins. A sector of a node is named by the end that
// begins it, counter-clockwise.
struct BranchGraph {
  // Branches by their first vertex and direction. The canvas must outlive this. Cost: O(#V +
  // curves).
  explicit BranchGraph(Canvas& drawn_on);

  struct Branch {
    std::vector<VertexId> vertices;  // with both nodes
    Curve kind = Curve::kNone;
  };
  Canvas& canvas;
  std::vector<Branch> branches;
  std::vector<Index> next_end;  // per end: the next one around its node, counter-clockwise

  const Branch& branch_of(Index end) const { return branches[at(end / 2)]; }
  VertexId node(Index end) const {
    const std::vector<VertexId>& vertices = branch_of(end).vertices;
    return end % 2 == 0 ? vertices.front() : vertices.back();
  }
  // The vertices of the branch in the order in which they are walked along.
  std::vector<VertexId> walked_from(Index end) const;
  // The half-edge by which a branch leaves its node at this end, and the end at which a branch has
  // this one.
  HalfedgeId leaving(Index end) const;
  Index end_of(HalfedgeId leaving) const;
  // Splits edges until every branch has four: paths find places inside each, also three on one
  // side.
  void divide();
};

// Branches one after the other, each named by the end at which the walk along it begins.
using BranchLoop = std::vector<Index>;

// Other ways for one branch of a cut that leave the cut's shape as it is, but cones on the other
// side of it (thesis 6.5.3.1, 6.5.3.2).
//
// Taken around a cone of excess e (k - 4) that was on its left, a loop needs to turn by e less:
// it turns by as much more than it needs. Around one on its right it is the other way round.

// By how much loops of a cut turn: on the map that padding will make, and as they are asked to
// (thesis 6.5.3).

// By how many quarter turns, to the left, a map is to turn along a closed strip of the surface's
// faces (half-edges 3 f + k, never turning back). It must be that of some cross field
// (field::turning_number), so that it goes together with the cones.
using LoopTurning = std::function<Index(const intrinsic::DualLoop& strip)>;

// What will be drawn on a cut yet, as far as it bends the curves that are there.
struct Ending {
  // Sectors, named by their ends, that a path will divide in two: one more corner each.
  std::vector<Index> divided;
  // A branch, named by one of its ends, on whose left hand, as walked along from there, a loop will
  // begin and end: three corners on that side, one on the other. Or kInvalid.
  Index bent = kInvalid;
};

// The faces on the left of a closed chain of edges, drawn or not, as a strip of the input's faces.
// Cost: O(faces beside the loop).
intrinsic::DualLoop strip_on_input(const Canvas& canvas, const std::vector<VertexId>& cycle);

// Where all cones are even, whether a loop turns by an even or an odd number of quarters depends on
// its homology class alone: no way around cones changes it. Then the cut must be so from the start.
//
// Which loops are to turn by an odd number is told by one loop: those that cross it an odd number
// of times (Poincare duality mod 2). Drawn first, it makes a chain turn as it must
// (draw_twisted_chain()); along the other loops of the chain, disjoint from it, turns are even.

// The branches that close a loop of a homology basis along which the map is to turn by an odd
// number of quarters. Cost: as wished turns of that many loops.
std::vector<Index> odd_branches(const BranchGraph& graph, const LoopTurning& turning);

// Erases the curves and draws one loop in their place that crosses these branches once each, and no
// other one; returns its vertices in order. Preconditions: the curves cut the canvas into one disk;
// divide(); at least one branch. Cost: O(#F log #F) a branch.
std::vector<VertexId> draw_loop_across(const BranchGraph& graph,
                                       const std::vector<Index>& branches);

// What has been done to a cut.
struct Reroutings {
  Index loops = 0;     // of the homology basis
  Index shortest = 0;  // branches that took the shortest detour (thesis 6.5.3.1)
  Index fallback = 0;  // branches that were led around cones one by one (6.5.3.2)
  Index quarters = 0;  // by how many quarter turns the loops were off, all together
  Index straight = 0;  // cuts whose chain was drawn straight along the field
};

// What a cut shall turn like, and the notes about it.
struct WishedTurns {
  LoopTurning turning;
  // What crossing each half-edge adds to the angles around its source (paths.h) in angles in which
  // loops turn as `turning` says: less the rotation of a field across it. The chain is drawn
  // straight along it; empty: its curves are as short as they can be.
  std::vector<double> crossings;
  Reroutings* done = nullptr;  // added to; never null
};

// Reroutes branches so that loops turn as wished when the cut ends in one of the ways `endings`:
// the one that takes the least; returns its number.
// Preconditions: the curves cut the canvas into one disk; divide(), also afterwards.
// Throws NotConverged (kBadAngles) if cones have a common divisor that what is missing has not,
// (kIterationLimit) if the cut takes more vertices than it may.
// Cost: O(#F log #F) per branch that is rerouted.
std::size_t reroute(BranchGraph& graph, const std::vector<Ending>& endings,
                    const WishedTurns& wished);

}  // namespace flipfree::seamless
