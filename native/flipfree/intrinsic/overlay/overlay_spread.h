// Room between the crossings of an overlay.
//
// Which curves cross an edge, and in which order, is known exactly; where they cross it is known in
// doubles. In a metric that is sheared far away from the input's, thousands of curves run closer
// beside each other than doubles resolve, and triangles between them turn over. A map up to isotopy
// needs the order only: with every crossing drawn a little towards an even spacing, all are apart,
// and pieces of straight curves in a triangle that do not cross by their order do not cross.
#pragma once

#include "flipfree/intrinsic/overlay/overlay_positions.h"
#include "flipfree/intrinsic/overlay/overlay_trace.h"

namespace flipfree::intrinsic {

// Moves every place, along the edge and along the curve, by `share` (0 to 1) of the way to where it
// were if all crossings there were evenly spaced. Then two of n neighbours are share / (n + 1) of
// the edge apart, up to rounding. Cost: O(crossings log crossings).
void spread_crossings(const OverlayTrace& trace, double share, OverlayPositions& positions);

}  // namespace flipfree::intrinsic
