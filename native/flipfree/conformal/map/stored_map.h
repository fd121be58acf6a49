// A laid out map as it is stored: in the fields that every solver returns, and in 32 bits.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/intrinsic/layout/layout.h"

namespace flipfree::conformal {

// Moves surface, UVs, provenance and cut edges to `map`, with the nearest 32-bit UVs. What else
// `layout` holds stays
// there.
void take_map(intrinsic::MetricLayout& layout, certify::Parametrization& map);

// A map that is valid in 64 bits, rounded to other 32-bit points than the nearest where these would
// flip a triangle. False, and the map unchanged, if there are none.
bool repair_rounding(certify::Parametrization& map, ExecutionContext& context);

// Largest difference, over the vertices with a prescribed angle, between that angle and the one of
// the stored values.
double stored_angle_error(const certify::Parametrization& map,
                          const std::vector<std::pair<VertexId, double>>& prescribed);

}  // namespace flipfree::conformal
