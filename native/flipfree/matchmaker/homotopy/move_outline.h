// Brings a map from a convex polygon onto an outline through the frames of a homotopy
// (outline_homotopy.h), along maps that are all flip-free, refining the surface where the way is
// blocked.
//
// From frame to frame the boundary and the pins are prescribed, everything else follows by Newton
// steps of the distortion's energy (distortion/targets.h). A frame that is not reached is
// tried again nearer; where steps become hard, the edges that are too long to bend with
// the outline are split: those of the triangles that would fold first if every vertex rode on the
// homotopy (Carrier). Every map on the way is valid, so inner vertices keep winding once, and the
// disk that the homotopy's triangulation stands for, one of perhaps several with that outline, is
// the one that is reached.
#pragma once

#include <optional>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// The way to an outline that winds: a map onto a convex polygon, the first frame of a homotopy
// (outline_homotopy.h), and from there to the last.

// Precondition: a prescribed boundary. Nothing if the way is blocked. Stats:
// "time_limit_reached".
std::optional<Solution> by_homotopy(const Problem& problem, ExecutionContext& context,
                                    Stats& stats);

}  // namespace flipfree::matchmaker
