// A coarse triangulation of a flat disk by some of its vertices: where pins that move far are
// moved on before the fine surface follows (coarse_to_fine.h).
//
// Vertices are removed one after another, those with the smallest stars on the surface first and no
// two neighbours in one round, so that the ones left are spread evenly. Every star is
// retriangulated in the flat map. So the coarse disk covers the same domain as the fine one, also
// where that overlaps itself, and every fine vertex lies in a known coarse triangle.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

struct CoarseDisk {
  mesh::Surface surface;       // in space, its corners are vertices of the fine disk
  std::vector<VertexId> fine;  // #coarse vertices, ascending: which ones
  // Of every fine vertex: the coarse one that it is, or kInvalid, and then the coarse face that
  // holds it (closed, by exact test, in map.uv).
  std::vector<VertexId> coarse;
  std::vector<FaceId> face;
};

// Removes inner vertices of `map` (flip-free, inner vertices wind once) that are not in `keep` (#V)
// down to `target` vertices, or until stars that allow it run out. Guarantee: coarse faces are
// positive in map.uv by exact test. Cost: O(#V log #V).
CoarseDisk decimate(const mesh::RefinedMap& map, const std::vector<char>& keep, Index target,
                    const ExecutionContext& context);

}  // namespace flipfree::matchmaker
