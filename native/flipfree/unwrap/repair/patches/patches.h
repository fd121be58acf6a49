// Parts of a chart whose vertices are placed anew between neighbours that stay where they are.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/unwrap/repair/patches/damage.h"

namespace flipfree::unwrap {

// Unfolds what is bad (find_damage, of a spoilt chart) in the chart's map and moves no more than
// that takes: first as few vertices as every bad face has one of, those in the same place as others
// before all; where that does not open them at about the distortion around, all vertices of bad
// faces, and more and more rings around these. Vertices that move are placed between those that
// stay by distortion::Untangler, and relaxed. False if something bad is left, whose vertices are
// where they were. Deterministic; the same for any number of threads. Precondition: a known
// density. Cost: a few Newton solves of the parts that move.
bool mend_in_place(const DamagedChart& chart, Points2& uv, ExecutionContext& context);

// Faces that lie on others (flags `over`) are relaxed with `rings` around them, the rest held.
// Precondition: every face is positive. The result is flip-free; whether it still overlaps is for
// the caller to see.
Points2 relaxed_around(const DamagedChart& chart, const std::vector<char>& over, Index rings,
                       const Points2& uv, ExecutionContext& context);

}  // namespace flipfree::unwrap
