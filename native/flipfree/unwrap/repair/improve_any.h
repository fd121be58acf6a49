// Improving maps that have flipped faces.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/distortion/improve.h"

namespace flipfree::unwrap {

// distortion::improve() for any map: one with flipped faces is repaired first, its overlaps kept.
// Then stats also has what repair() says of the map before and of its charts.
certify::Parametrization improve_any(const mesh::Surface& surface, const Points2& corner_uv,
                                     const distortion::ImproveOptions& options,
                                     ExecutionContext& context);

}  // namespace flipfree::unwrap
