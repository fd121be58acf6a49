// All islands of an unwrap onto the plane, each on its own, cut further where they overlap.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/stats.h"
#include "flipfree/unwrap/chart/chart_pins.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/islands/unwrap_options.h"

namespace flipfree::unwrap {

// An error about chart `c`, with elements of the user's mesh instead of the chart's own.
Error in_terms_of_input(Error error, const Islands& islands, std::size_t c);

// Every chart onto the plane, cut further where that is the way to keep it from overlapping itself:
// then `islands` are those that result. Per chart #V x 2. acceptable: maps may be taken as they are
// (ExecutionContext::accept). Stats: "overlap_cuts", and those of the largest chart. Throws what
// flatten_chart() throws, in terms of the user's mesh.
std::vector<Points2> flatten_islands(Islands& islands, const mesh::Surface& surface,
                                     const mesh::Adjacency& adjacency,
                                     const mesh::EdgeFlags& uncuttable, const ChartPins& pins,
                                     const UnwrapOptions& options, bool acceptable,
                                     ExecutionContext& context, Stats& stats);

}  // namespace flipfree::unwrap
