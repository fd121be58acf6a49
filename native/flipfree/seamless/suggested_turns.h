// Cones of whole quarter turns for a surface that has none yet.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/suggest_cones.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// Quarter turns per vertex, 4 where it is flat, kNotGiven at boundaries, as check_request() accepts
// them: those of conformal::suggest_cones on every connected part by itself; none where these would
// be the cones 3 and 5 on a torus. The options' quantum is not looked at, max_seconds hold for each
// part. Errors: those of check_request() but for cones, and of suggest_cones().
std::vector<Index> suggested_turns(const mesh::Surface& surface,
                                   const conformal::SuggestConesOptions& options,
                                   ExecutionContext& context);

}  // namespace flipfree::seamless
