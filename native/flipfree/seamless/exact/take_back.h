// Takes refinement back: an engine refines the surface where its metric crosses the user's edges,
// most of which a less distorted map does not need.
//
// A seamless map is a local thing: the refined faces of one parent are brought into one frame,
// across seams by their quarter turns and translations; so are the frames of neighbours, and the
// user's own triangles are cut and laid out anew, their flips opened on a grid. Where they are too
// many, the map is improved under its seams' constraints, and they are tried again; what is left is
// written on as few triangles as its values allow (intrinsic/layout/refine_map.h).
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// `map`: of `input`, flip-free in 64 bits, seamless up to rounding, with provenance and cut_edges.
// `aligned`: per face of the input, does the boundary of its part run along the axes? `uncuttable`:
// edges that a new cut avoids. Guarantee: as before, better distorted or the same, or without any
// vertex added, and the cut is another then. Stats: "taken_back.rounds", "taken_back.vertices".
// When the context's time is over it ends with what it has. Throws Cancelled. Cost: some Newton
// steps per round but the first.
void take_back(const mesh::Surface& input, const std::vector<char>& aligned,
               const IndexPairs& uncuttable, int max_iterations, certify::Parametrization& map,
               ExecutionContext& context);

// A map of a refined surface as one that is known at the corners of `input` and at points along its
// edges; nullopt where vertices were added inside its faces. Cost: O(#F log #F).
std::optional<intrinsic::EdgePointMap> edge_point_map(const mesh::Surface& input,
                                                      const certify::Parametrization& map);

}  // namespace flipfree::seamless
