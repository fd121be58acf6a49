// From a seamless map in floating point to one that is seamless exactly, in 64 and in 32 bits.
//
// All coordinates are integers, at most 2^23 in size, in units of one power of two: floats hold
// them, in the first quadrant too, and doubles hold all their sums and differences, so that every
// transition is exact as stored.
// Free coordinates are rounded, the others follow without error (constraints.h).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion {

struct GridMap {
  Points2 uv;       // #V of the cut surface; every value is a float
  double step = 0;  // of the grid, a power of two
};

// `uv` is flip-free by the exact test and meets the constraints up to rounding; `seams` are those
// that the constraints were made of. Every component is
// centred at the origin, not scaled. Guarantee: every
// triangle is positively oriented and every seam edge's two sides are related by its quarter turn
// and by the translation given, exactly; edges of one branch have one translation, up to their
// units. `unit`: components are centred by multiples of it, and translations, lines and held places
// that are multiples of it stay so, as far as the grid is fine enough; 0: there is none. `held`:
// nodes that no repair moves (flags; empty: none). Triangles that rounding would fold are opened
// again by moving free positions around them on the grid, or in 64 bits over a region that grows as
// far as it must. stats: "rounding.repaired" (free positions that are not at their nearest grid
// point), "rounding.folded" (triangles that plain rounding folds), "rounding.opened" (times that a
// region was opened), "rounding.step". Throws NotConverged (kRoundingFlips) naming the faces if the
// map needs more than 24 bits. Cost: O(#F), plus the repairs.
GridMap round_to_grid(const SeamConstraints& constraints, const Triangles& faces,
                      const std::vector<SeamEdge>& seams, const Points2& uv,
                      ExecutionContext& context, Stats& stats, double unit = 0.0,
                      const std::vector<char>& held = {});

// A map that may flip some triangles, at most `most`, moved to the grid and its flips opened there
// by moving free positions alone; nothing if that does not open them all. Translations do not
// change but by rounding.
std::optional<Points2> unfold_on_grid(const SeamConstraints& constraints, const Triangles& faces,
                                      const std::vector<SeamEdge>& seams, const Points2& uv,
                                      std::size_t most, ExecutionContext& context);

}  // namespace flipfree::distortion
