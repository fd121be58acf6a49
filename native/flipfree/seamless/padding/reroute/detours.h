// Other ways for one branch of a cut that leave the cut's shape as it is, but cones on the other
// side of it (thesis 6.5.3.1, 6.5.3.2).
//
// Taken around a cone of excess e (k - 4) that was on its left, a loop needs to turn by e less:
// it turns by as much more than it needs. Around one on its right it is the other way round.
#pragma once

#include <optional>
#include <set>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths/canvas.h"

namespace flipfree::seamless {

// A branch, by its vertices with both nodes, such that along it a map is to turn by `change` more
// than along the present one. The curves cut the canvas into one disk, before and after.

// The shortest one on either side, drawn in the branch's place; nothing, and nothing is drawn, if
// the search finds none that does not meet itself.
std::optional<std::vector<VertexId>> draw_shortest_detour(Canvas& canvas,
                                                          const std::vector<VertexId>& branch,
                                                          Index change,
                                                          const ExecutionContext& context);

// From a place of the branch out to the nearest cone that makes for one of the changes, around it
// and back. Always there. Preconditions: none is 0, some cone makes for one; the branch has an
// inner vertex.
struct Detour {
  std::vector<VertexId> branch;
  Index change = 0;
};
Detour draw_detour_around_cone(Canvas& canvas, const std::vector<VertexId>& branch,
                               const std::set<Index>& changes, const ExecutionContext& context);

}  // namespace flipfree::seamless
