// The engines that find a map with a field's topology: penner first, padding on a rerouted cut
// where that is told, or where penner ends without (thesis 6.5).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/cross_field.h"
#include "flipfree/holonomy/needed_topology.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "flipfree/seamless/padding/cut_components.h"
#include "flipfree/seamless/padding/padding.h"
#include "flipfree/seamless/padding/topology.h"
#include "flipfree/seamless/penner/penner.h"

namespace flipfree::holonomy {

// All components cut for padding, such that the map that comes of it turns as the field does along
// every loop; or, without `reroute`, as it happens to. `cones`: the field's. Adds to `done`.
// Precondition: a closed valid surface. Errors: as seamless::make_turning_cut().
seamless::RefinedPieces field_cut(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                  const field::CrossField& field, const std::vector<Index>& cones,
                                  bool reroute, seamless::Reroutings& done,
                                  ExecutionContext& context);

// A map with the topology `needed`, which is the field's, and without flips. Stats: the engine's,
// "engine"; of padding "reroutings.loops" (of homology bases), "reroutings.guided" (branches that
// took the shortest detour between the cones), "reroutings.fallback" (led around cones one by one),
// "reroutings.quarters" (by which loops were off), "reroutings.straight" (components whose cut is
// straight along the field; others have curves as short as they can be). `reroute` false: padding's
// loops turn as they happen to, so that the topology is that of the cones alone. Throws
// InvalidInput (kBadOption) if padding is asked for on an open surface; else as the engines.
seamless::PennerMap engine_map(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                               const field::CrossField& field, const NeededTopology& needed,
                               seamless::Engine which, bool reroute,
                               const seamless::PennerMapOptions& options,
                               ExecutionContext& context);

}  // namespace flipfree::holonomy
