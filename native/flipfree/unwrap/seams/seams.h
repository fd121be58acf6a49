// Automatic seams by themselves: the edges, without the map that they allow.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/unwrap_options.h"

namespace flipfree::unwrap {

// Vertex pairs, each once: options.cuts as far as they are inner edges of the mesh, and all that is
// needed beyond them (auto_islands.h), so that unwrap() with these cuts stays within the bound of
// distortion and cuts nothing more. Any triangles, as for unwrap(). When options.max_seconds are
// over, the seams that were found by then. Throws InvalidInput, NotConverged, Cancelled.
IndexPairs find_seams(const mesh::Surface& surface, const UnwrapOptions& options,
                      ExecutionContext& context);

}  // namespace flipfree::unwrap
