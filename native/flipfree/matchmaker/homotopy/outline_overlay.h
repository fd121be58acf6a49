// Onto an outline in one step, by cutting: MatchMaker++ whose paths are straight lines in a good
// drawing.
//
// The first frame of a homotopy (outline_homotopy.h) and its last have one triangulation, so every
// edge of a convex partition of the target is a straight line between the same two vertices of the
// first frame, and these lines do not cross. A map at the first frame therefore is a drawing of the
// surface in which all paths are known from the start: they are traced there one after another
// without drawing anything again, and since the drawing is of low distortion, so are the pieces.
// Frames in between are not needed, and nothing can be blocked.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/homotopy/outline_homotopy.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Precondition: first.uv is flip-free and at the homotopy's frame 0, pins included. The result is
// at frame 1, outline and pins bit for bit: always in exact arithmetic; NotConverged where a piece
// is thinner than 64 bits resolve. New vertices: the crossings of the partition's edges with the
// surface's. Stats: "matchmaker.*". Cost: O(n log n) for n crossings, and small embeddings.
mesh::RefinedMap lay_onto_target(const mesh::RefinedMap& first, const OutlineHomotopy& homotopy,
                                 ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
