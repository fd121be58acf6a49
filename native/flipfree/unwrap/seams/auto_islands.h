// Islands whose seams are found: short ones, few islands, and as little distortion as was asked.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

struct AutoIslands {
  Islands islands;
  std::vector<Points2> uv;  // per chart #V x 2, at the surface's own scale
};

// The surface cut along `seams` and along what was found beyond them, every chart flat: no flip,
// and no chart on itself with options.bijective. placed: the same where the user has it, for what
// is seen and what is symmetric. Seams do not run along `uncuttable` edges where there is another
// way. Precondition: a validated surface at ordinary coordinates, no pins. Throws what
// flatten_islands() throws; with options.seams.edges_only there may be no maps once time is over.
// Stats: those of flatten_islands(). Cost: some ten Newton systems and some tens of scalar ones per
// chart.
//
// Where `placed` has a plane that maps it to itself (find_mirror), but not all seams to seams,
// every group of islands that it maps onto each other gets the seams of one side and their images,
// or all seams and their images, whichever cost least. Groups stay as they are where these cost
// much more than what was found, and where an island would have to be opened or would not keep the
// bound of stretch; all do where `seams`, which stay, are not symmetric.
AutoIslands find_islands(const mesh::Surface& surface, const mesh::Surface& placed,
                         const mesh::EdgeFlags& seams, const mesh::EdgeFlags& uncuttable,
                         const UnwrapOptions& options, ExecutionContext& context, Stats& stats);

// Automatic seams by themselves: the edges, without the map that they allow.

// Vertex pairs, each once: options.cuts as far as they are inner edges of the mesh, and all that is
// needed beyond them (auto_islands.h), so that unwrap() with these cuts stays within the bound of
// distortion and cuts nothing more. Any triangles, as for unwrap(). When options.max_seconds are
// over, the seams that were found by then. Throws InvalidInput, NotConverged, Cancelled.
IndexPairs find_seams(const mesh::Surface& surface, const UnwrapOptions& options,
                      ExecutionContext& context);

}  // namespace flipfree::unwrap
