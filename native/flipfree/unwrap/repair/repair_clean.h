// Repair of a map of a clean surface (certify::is_clean).
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/unwrap/repair/repair_options.h"

namespace flipfree::unwrap {

// As repair() says, without "seconds".
certify::Parametrization repair_clean(const mesh::Surface& surface, const Points2& corner_uv,
                                      const RepairOptions& options, ExecutionContext& context);

}  // namespace flipfree::unwrap
