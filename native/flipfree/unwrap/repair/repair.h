// A map with flipped, collapsed or overlapping faces, mended with as little change as possible.
//
//   read_map()       its charts; corners without a value, pins             given_map.h
//   mend_chart()     one chart: mirrored, unfolded in place, or made anew  mend_chart.h
//   judge_stretched()  drawn out more than it has to be, made better       mend_chart.h
//   mend_in_place()  few vertices, then more and more around them          patches.h
//   settle()         what has no place is packed, all is stored
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/unwrap/repair/mend_chart.h"

namespace flipfree::unwrap {

// corner_uv: 3 #F x 2, any values: a corner that is not finite, or beyond what 32 bits hold, has no
// place and gets one. The map is cut where the values on the two sides of an edge differ.
//
// Guarantee: the result is certified (G1, G2, G3 for pins, G7; overlaps 0 unless they are kept;
// disjoint charts if asked for, but for charts with pins). Charts without damage keep their 64-bit
// values bit for bit, and so do vertices of the others that need not move. Stats: of the map before
// "flips_before", "winding_failures_before", "overlaps_before", "island_overlaps_before" (-1: not
// measured), "energy_before" (infinite with flips), "corners_without_place", "corners_rejoined"
// (read_map()); of the result "charts", "charts_mirrored", "charts_unfolded", "charts_anew",
// "charts_cut", "charts_moved", "charts_improved" and "charts_stretched_anew" (stretched ones, made
// better where they are and unwrapped again), "stretched_charts" (those that still are),
// "added_cuts", "corners_kept" (of 3 #F), "energy", "max_energy", "seconds". Any triangles: what is
// no oriented manifold surface is separated first, along the map. Throws InvalidInput (a mesh
// without meaning, options, kBadPins), NotConverged (pins that no map on these triangles was found
// for; kTimeLimit; rounding; certificate), Cancelled.
certify::Parametrization repair(const mesh::Surface& surface, const Points2& corner_uv,
                                const RepairOptions& options, ExecutionContext& context);

}  // namespace flipfree::unwrap
