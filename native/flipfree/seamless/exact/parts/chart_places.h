// Where the charts of a map on a grid lie: beside each other, in rows.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::seamless {

// Moves charts by multiples of `step` so that their boxes lie in rows and do not meet, about as
// wide as high altogether, centred at the origin. `chart_of_face`: numbers from 0 to `charts` - 1.
// Precondition: all coordinates are multiples of `step`, at most 2^23 of them. Guarantee:
// afterwards too, without rounding; a map that would not fit, or has one chart, stays as it is.
// Cost: O(#F + charts log charts).
void spread_charts(const std::vector<Index>& chart_of_face, Index charts, double step,
                   Points2& corner_uv);

}  // namespace flipfree::seamless
