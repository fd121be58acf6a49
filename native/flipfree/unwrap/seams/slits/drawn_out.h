// Places of a map that are drawn out, relaxed by themselves.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// uv: #V x 2, flip-free. Where triangles are drawn out, they and a few rings around them are
// relaxed, and what lies beside them stays: Newton steps of the whole map would all be shortened by
// the few that are worst. keep_boundary: vertices of the boundary stay. Flip-free; deterministic
// for any number of threads. Cost: O(#F), and Newton steps of those places.
Points2 relaxed_where_drawn_out(const mesh::Surface& surface, Points2 uv, bool keep_boundary,
                                ExecutionContext& context);

}  // namespace flipfree::unwrap
