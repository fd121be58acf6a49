// Seams of symmetric surfaces that are symmetric.
#pragma once

#include <vector>

#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/seams/sheet.h"

namespace flipfree::unwrap {

// Gives found islands and their maps (per chart #V x 2; none: nothing is done) other seams where
// `placed` has a plane that maps it to itself (find_mirror), but not all seams to seams: of every
// group of islands that it maps onto each other the seams of one side and their images, or all
// seams and their images, whichever cost least by `cost` (per half-edge). Groups stay as they are
// where these cost much more than what was found, and where an island would have to be opened or
// would not keep the bound of stretch; all do where `given` seams, which stay, are not symmetric.
// Throws Cancelled. Cost: O(#F), and up to three maps of the islands that change.
void make_symmetric(Islands& islands, std::vector<Points2>& uv, const mesh::Surface& surface,
                    const Points3& placed, const mesh::Adjacency& adjacency, const Mirror& mirror,
                    const std::vector<double>& cost, const mesh::EdgeFlags& given,
                    const mesh::EdgeFlags& uncuttable, const UnwrapOptions& options,
                    ExecutionContext& context);

}  // namespace flipfree::unwrap
