// Islands whose map is valid, but drawn out more than it has to be.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/unwrap/repair/mend_chart.h"
#include "flipfree/unwrap/repair/repair_options.h"

namespace flipfree::unwrap {

// An island is stretched if its energy is more than so many times that of an unwrap of it: along
// its border and its seams, with its pins; without them where the unwrap does not hold them.
inline constexpr double kStretchedRatio = 1.1;
// Islands of more faces are not judged for a mere count.
inline constexpr Index kMostJudged = 50'000;

// Judges the pieces that `mended` falls into, each as an island of its own and at its own best
// scale, and counts those that are stretched (options.stretched), in mended.stretched. With
// kImprove they are made better: where they are, all vertices but the pinned free, or by that
// unwrap where this is not enough. Both keep the island's size, direction and middle, and are
// flip-free. Its size is the median density of its faces, or given.density where a twentieth of
// them has less and a twentieth more. What is unwrapped already is not stretched. Throws Cancelled,
// TimeIsOver (kImprove only). Cost: O(#F), and for islands of an energy above 1.1 an unwrap of
// them.
void judge_stretched(const ChartToMend& given, const RepairOptions& options, MendedChart& mended,
                     ExecutionContext& context);

}  // namespace flipfree::unwrap
