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
// and no chart on itself with options.bijective. placed: the user's positions, for what is seen.
// Seams do not run along `uncuttable` edges where there is another way. Precondition: a validated
// surface at ordinary coordinates, no pins. Throws what flatten_islands() throws. Stats: those of
// flatten_islands() and "seams_energy". Cost: some ten Newton systems and some tens of scalar ones
// per chart.
AutoIslands find_islands(const mesh::Surface& surface, const Points3& placed,
                         const mesh::Adjacency& adjacency, const mesh::EdgeFlags& seams,
                         const mesh::EdgeFlags& uncuttable, const UnwrapOptions& options,
                         ExecutionContext& context, Stats& stats);

// Automatic seams by themselves: the edges, without the map that they allow.

// Vertex pairs, each once: options.cuts as far as they are inner edges of the mesh, and all that is
// needed beyond them (auto_islands.h), so that unwrap() with these cuts stays within the bound of
// distortion and cuts nothing more. Any triangles, as for unwrap(). When options.max_seconds are
// over, the seams that were found by then. Throws InvalidInput, NotConverged, Cancelled.
IndexPairs find_seams(const mesh::Surface& surface, const UnwrapOptions& options,
                      ExecutionContext& context);

}  // namespace flipfree::unwrap
