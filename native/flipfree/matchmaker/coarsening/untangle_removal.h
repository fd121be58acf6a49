// Takes refinement back where the vertices around have to move for it: an added vertex is left out,
// its star filled whether or not all of it is positive, and the neighbourhood untangled
// (untangle.h), its rim held.
//
// What remove_vertex.h leaves behind are local minima: no vertex can go as the others lie, although
// most can when their neighbours make room.
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Neighbourhoods that were untangled in vain. Until a vertex near by is removed, or joined to
// others, another try is not worth its time.
using VainRemovals = std::unordered_set<std::uint64_t>;

// Newton steps per vertex where a vertex less is worth twice the usual time.
inline constexpr int kThoroughIterations = 80;

struct UntangleRemovalOptions {
  int rings = 2;        // vertices within so many edges of the one that is removed may move
  int iterations = 40;  // Newton steps per vertex at the most
  VainRemovals* vain = nullptr;  // of former passes over the same map; null: none
};

// One pass over the vertices from `keep` on that are not held, the last first. The boundary does
// not move, nor do `held` vertices. The map stays valid, also as stored, and interior vertices go
// on winding once. Returns the number removed; vertices stay as isolated ones until compacted.
// Cost: some twenty Newton steps on fifty triangles per vertex, half a millisecond; with one ring a
// third of it.
Index remove_by_untangling(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           ExecutionContext& context, const UntangleRemovalOptions& options = {});

}  // namespace flipfree::matchmaker
