// A seamless map brought to other translations across its seams, without a flip.
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion {

// The map on a grid (#V x 2 of the cut surface) whose translations, lines and cones are those of
// `goal` rounded to whole numbers, as are the places there of the vertices marked in `held` (#V);
// one of each component that moves with no translation is. All others move as little as goes with
// it, by the symmetric Dirichlet energy of the change of shape. `goal` (#V x 2) meets the seams'
// quarter turns; where it flips no triangle, the way begins there, else it begins at the map, and
// translations are moved as far as steps without flips go. nullopt if they do not arrive, or the
// grid does not hold the map. Precondition: the map is flip-free by the exact test. stats:
// "carried" ("at once", "pulled", or "not"), "carried.flips" (of the goal).
// Throws NotConverged (kFactorizationFailed), TimeIsOver, Cancelled.
std::optional<Points2> carried_to(const CutMap& map, const Points2& goal,
                                  const std::vector<char>& held, ExecutionContext& context,
                                  Stats& stats);

}  // namespace flipfree::distortion
