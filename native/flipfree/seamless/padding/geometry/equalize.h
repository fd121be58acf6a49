// How far every segment is padded so that the two sides of every branch become equally long
// (thesis 5.2.5, 5.4.3).
#pragma once

#include <vector>

#include "flipfree/seamless/padding/plane/wide_plane.h"
#include "flipfree/seamless/padding/segments.h"

namespace flipfree::seamless {

// Factors for the components' metrics, each known up to scale, by which mates become as equally
// long as scaling alone can make them. `length`: per segment.
std::vector<double> component_scales(const CutSegments& segments, const EqualizationSystem& system,
                                     const std::vector<Wide>& length);

// Widths w >= 0, one per segment, with A w = b in the precision of the lengths (in the fourfold
// case, where rows depend on each other, up to what the lengths miss of that): the solution of
// least norm, then the same number added to all of them (those of the extra path stay zero:
// Proposition 12). Throws InternalError if A cannot be solved, which no cut from topology/ allows.
// Cost: cubic in the number of segments, small.
std::vector<Wide> padding_widths(const EqualizationSystem& system, const std::vector<Wide>& length);

// Lengths of all segments after padding (5.2).
std::vector<Wide> padded_lengths(const CutSegments& segments, const std::vector<Wide>& length,
                                 const std::vector<Wide>& width);

}  // namespace flipfree::seamless
