// What every function that starts from a finished map asks of it.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

// Throws InvalidInput, naming the faces, unless the surface is valid and every triangle of
// `corner_uv` (one row per face corner) is positive by the exact predicate.
void require_valid_map(const mesh::Surface& surface, const Points2& corner_uv,
                       const ExecutionContext& context);

// Throws InvalidInput (kBadShape) unless there is a row for every corner.
void require_corner_uv(const mesh::Surface& surface, const Points2& corner_uv);

}  // namespace flipfree::distortion
