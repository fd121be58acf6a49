// One map in 64 bits that plain rounding takes to the stored one.
//
// Where rounding to 32 bits would have folded a triangle, the stored values are others than the
// nearest to the solver's. Whoever rounds the solver's values himself gets the fold back.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::certify {

// Sets map.agreed for a map whose certificate for `request` is ok: empty if map.uv rounds to
// map.uv32 everywhere. Else the solver's values, with the stored ones wherever they do not round to
// these; or, where that does not pass the same certificate, or angles are prescribed, the stored
// values alone. Should these not pass either (an infinite energy), map.certificate says so. Cost:
// O(#F); a second certificate where rounding was repaired.
void agree_with_storage(Parametrization& map, const CertifyRequest& request,
                        const ExecutionContext& context);

}  // namespace flipfree::certify
