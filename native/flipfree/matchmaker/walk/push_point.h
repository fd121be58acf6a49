// Pushes one vertex of a valid map to another place by a piecewise linear deformation of the plane
// that changes nothing outside a convex corridor: the step that cannot be blocked.
//
// With x the vertex's place, y its goal, both strictly inside the corridor, and lambda the tent
// over it (piecewise linear, 1 at x, 0 on the corridor's sides), the deformation is
//
//     phi(p) = p + lambda(p) (y - x),
//
//                  .---------------.        a homeomorphism of the plane: every triangle
//                 /  \           /  \       (x, h_i, h_i+1) between the centre and a side goes
//                h - - x - - - y - - h      to (y, h_i, h_i+1), which is positive as well.
//                 \  /           \  /
//                  '---------------'
//
// A locally injective map stays so when it is followed by a homeomorphism. A triangle of the mesh
// that phi bends is replaced by its linear interpolant, which is split along the creases of phi
// only if it would be turned over or squashed: a mesh that is fine against the corridor needs no
// new vertex. Splitting ends at the overlay of mesh and creases, where nothing bends.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/request/polygon.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Moves `vertex` to `goal` exactly. `corridor`: strictly convex, counter-clockwise, with the
// vertex's place and the goal strictly inside and no vertex that is marked in `held` (#V) inside.
// Preconditions: map.uv is flip-free. True: every face is positive by exact test, vertices outside
// the corridor and held ones have not moved, at most `most_added` vertices were added (at the end
// of the numbering). False, and the map unchanged, if rounding or that limit is in the way.
// Cost: O(#V + #F) of a few operations, and O(log) per vertex added.
bool push_point(mesh::RefinedMap& map, VertexId vertex, const Vector2& goal,
                const Polygon& corridor, const std::vector<char>& held, Index most_added,
                ExecutionContext& context);

}  // namespace flipfree::matchmaker
