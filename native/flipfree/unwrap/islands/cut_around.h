// Part of a chart cut off from the rest, around a place where the chart as a whole cannot be
// stored.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

// Flags, on both sides, of the edges between the faces within `rings` steps across vertices of
// `faces` (of the surface; those outside the chart are ignored) and the rest of chart `c`. Where
// that is all of it or nothing, the chart is halved instead. Edges of `uncuttable` (may be empty)
// are spared; all flags are 0 where that leaves no cut. Deterministic. Cost: O(#F).
mesh::EdgeFlags cut_around(const Islands& islands, std::size_t c, const std::vector<FaceId>& faces,
                           Index rings, const mesh::Surface& surface,
                           const mesh::Adjacency& adjacency, const mesh::EdgeFlags& uncuttable);

}  // namespace flipfree::unwrap
