// Shapes for triangles that have none.
#pragma once

#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// Share of the length of a vertex's edges by which it is moved.
inline constexpr double kRestShift = 1e-3;

// Positions at which every face has a shape (shapeless_faces()): corners of faces without one are
// moved, each in a direction of its own, by kRestShift of the mean length of the edges around (of
// all edges, where these have no length either; by 1 where none has). Others stay as they are, bit
// for bit. Deterministic. Cost: O(#F).
Points3 rest_positions(const Surface& surface);

}  // namespace flipfree::mesh
