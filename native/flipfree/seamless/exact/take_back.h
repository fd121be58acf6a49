// Takes refinement back: an engine refines the surface where its metric crosses the user's edges,
// most of which a less distorted map does not need.
//
// In rounds: the map is improved under its seams' constraints, then written again on as few
// triangles as its present values allow (intrinsic/layout/refine). New vertices lie on edges of the
// input, so that a vertex on a seam goes on both sides at once. Where few faces are left that
// cannot be whole, the user's own triangulation is tried, its flips opened on a grid; first of all
// with the engine's values.
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// `map`: of `input`, flip-free in 64 bits, seamless up to rounding, with provenance and cut_edges.
// `aligned`: per face of the input, does the boundary of its part run along the axes? `uncuttable`:
// edges that a new cut avoids. Guarantee: as before, with no vertex more; better distorted or the
// same. Vertices inside input faces: all are taken back or none, on a closed surface, and the cut
// is another then. Stats: "taken_back.rounds", "taken_back.vertices", "distortion.*" of
// the last optimisation. When the context's time is over it ends with what it has. Returns whether
// the map's optimisation has converged. Throws Cancelled. Cost: a few Newton steps per round; those
// of one optimisation where the user's own triangulation does at once.
bool take_back(const mesh::Surface& input, const std::vector<char>& aligned,
               const IndexPairs& uncuttable, int max_iterations, certify::Parametrization& map,
               ExecutionContext& context);

// A map of a refined surface as one that is known at the corners of `input` and at points along its
// edges; nullopt where vertices were added inside its faces. Cost: O(#F log #F).
std::optional<intrinsic::EdgePointMap> edge_point_map(const mesh::Surface& input,
                                                      const mesh::Adjacency& adjacency,
                                                      const certify::Parametrization& map);

// A seamless map of a refined surface, written on the user's own triangles.
//
// Where cuts pass through the user's faces, no face has its corners in one chart. But a seamless
// map is a local thing: the refined faces of one parent are brought into one frame, across seams
// by their quarter turns and translations; so are the frames of neighbours, and the user's surface
// is cut and laid out anew.

}  // namespace flipfree::seamless
