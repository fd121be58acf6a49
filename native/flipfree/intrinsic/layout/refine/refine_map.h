// Writes a map that is known at the input's corners and at points along its edges with as little
// refinement as it can: input triangles that are flip-free as they are stay whole; points are added
// where they are not, then taken out again wherever the triangles around them stay positive without
// them.
//
// New vertices lie on edges of the input only, so a refined triangle is a triangle fan of its own
// three sides' points: the provenance (G7) is exact, and whatever triangulation is chosen, a face
// of positive UV area in every part makes the map locally injective. Every decision is an exact
// orientation test on both the 64-bit and the 32-bit values.
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/layout/polygon/polygon_triangulation.h"
#include "flipfree/intrinsic/layout/refine/edge_point_map.h"
#include "flipfree/intrinsic/layout/refine/refined_layout.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

enum class Refinement {
  kAuto,   // only where needed
  kNever,  // the input's triangles, valid or not
  kFull    // every point, whether needed or not
};

// Cost: O(#F + points) plus O(k^3) per triangulated polygon of k points, k small after thinning.
RefinedLayout refine_map(const mesh::Surface& input, const mesh::Adjacency& adjacency,
                         const EdgePointMap& map, Refinement refinement, Storage storage,
                         const ExecutionContext& context);

}  // namespace flipfree::intrinsic
