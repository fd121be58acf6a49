// Paths around chosen cones of a disk, which always exist: what the proof of Proposition 11 (thesis
// 5.3.2) draws, for any set of cones.
//
//    from                  Fences (=) join the cones inside (o) with the boundary between `to` and
//   --*---------------     `from`, all others (x) with the rest of it. What is left of the disk is
//     |   x=======         connected, so a path leads between the fences.
//     '---------.
//   ======o     |
//   ------------*-----
//               to
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths/separating_path.h"

namespace flipfree::seamless {

// The path with exactly the cones `inside` on its left. Fences are removed and leave their
// refinement behind. Preconditions: places strictly between the ends on both sides. Throws
// NotConverged if there is no way, which cannot happen in a disk. Cost: O(cones #F log #F).
std::vector<HalfedgeId> fenced_path(Canvas& canvas, const DiskBoundary& boundary,
                                    const PathEnds& ends, const std::vector<VertexId>& inside,
                                    const ExecutionContext& context);

// The same from a place, which is no corner, around one cone back to it: what is inside has one
// corner.
std::vector<HalfedgeId> fenced_loop(Canvas& canvas, const DiskBoundary& boundary, Index place,
                                    VertexId inside, const ExecutionContext& context);

}  // namespace flipfree::seamless
