// Cuts whose loops turn as they are asked to (thesis 6.5.2, 6.5.3): branches are taken around cones
// until every loop of a homology basis does; then all loops do (quasi-additivity, thesis 6.2).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/paths/canvas.h"
#include "flipfree/seamless/padding/reroute/branch_graph.h"
#include "flipfree/seamless/padding/reroute/loop_turns.h"

namespace flipfree::seamless {

// What has been done to a cut.
struct Reroutings {
  Index loops = 0;     // of the homology basis
  Index shortest = 0;  // branches that took the shortest detour (thesis 6.5.3.1)
  Index fallback = 0;  // branches that were led around cones one by one (6.5.3.2)
  Index quarters = 0;  // by how many quarter turns the loops were off, all together
  Index straight = 0;  // cuts whose chain was drawn straight along the field

  Index rerouted() const { return shortest + fallback; }
  Reroutings& operator+=(const Reroutings& other);
};

// What a cut shall turn like, and the notes about it.
struct WishedTurns {
  LoopTurning turning;
  // What crossing each half-edge adds to the angles around its source (straight/flat_angles.h) in
  // angles in which loops turn as `turning` says: less the rotation of a field across it. The
  // chain is drawn straight along it; empty: its curves are as short as they can be.
  std::vector<double> crossings;
  Reroutings* done = nullptr;  // added to, if there is one
  // Vertices that a cut may have more than the input. Branches that wind around few cones again and
  // again double the refinement each time.
  Index most_added = 2'000'000;
};

// Reroutes branches so that loops turn as wished when the cut ends in one of the ways `endings`:
// the one that takes the least; returns its number. `input`: what the canvas was made of.
// Preconditions: the curves cut the canvas into one disk; divide_branches(), also afterwards.
// Throws NotConverged (kBadAngles) if cones have a common divisor that what is missing has not,
// (kIterationLimit) if the cut takes more vertices than it may.
// Cost: O(#F log #F) per branch that is rerouted.
std::size_t reroute(Canvas& canvas, const mesh::Surface& input, const std::vector<Index>& cones,
                    const std::vector<Ending>& endings, const WishedTurns& wished,
                    BranchGraph& graph, const ExecutionContext& context);

}  // namespace flipfree::seamless
