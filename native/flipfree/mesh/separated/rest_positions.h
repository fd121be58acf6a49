// Shapes for triangles that have none.
#pragma once

#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// Share of the length of a vertex's edges by which it is moved, at most, and at least.
inline constexpr double kRestShift = 1e-3;
inline constexpr double kLeastRestShift = 1e-6;
// Share of the least height of the faces around it by which it is moved, in between.
inline constexpr double kRestShiftOfHeight = 0.1;

// Positions at which every face has a shape (shapeless_faces()): corners of faces without one are
// moved, each in a direction of its own, by kRestShift of the mean length of the edges around (of
// all edges, where these have no length either; by 1 where none has); by less where faces around it
// are thin, whose own shape would be another one. Others stay as they are, bit for bit.
// Deterministic. Cost: O(#F).
Points3 rest_positions(const Surface& surface);

}  // namespace flipfree::mesh
