// The seams of a map as branches, and the quarter turn and translation across each.
//
// A branch is a chain of cut edges between two nodes: vertices where other than two cut edges meet,
// cones, and vertices of the surface's boundary. Along a branch the two sides of a seamless map
// differ by one rigid motion. Closed chains without a node begin at their lowest vertex.
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::seamless {

// Counter-clockwise by so many quarter turns, without rounding. `Vector` has x and y.
template <typename Vector>
requires requires(const Vector& v) { Vector{-v.y, v.x}; }
constexpr Vector turned(const Vector& v, Index quarters) {
  const Vector once = (quarters & 1) != 0 ? Vector{-v.y, v.x} : v;
  return (quarters & 2) != 0 ? Vector{-once.x, -once.y} : once;
}
inline Vector2 turned(const Vector2& v, Index quarters) {
  const Vector2 once = (quarters & 1) != 0 ? Vector2(-v.y(), v.x()) : v;
  return (quarters & 2) != 0 ? Vector2(-once) : once;
}

// Turns each chart so that those of its edges for which `counts` is true run along the axes as well
// as one turn can make them: the sum of length cos(4 angle) is largest. Seams stay seams up to
// rounding, as quarter turns are the same in every direction. `chart_of_face`: numbers from 0 to
// `charts` - 1; a chart without such edges stays.
void turn_to_axes(const std::vector<Index>& chart_of_face, Index charts,
                  const std::function<bool(HalfedgeId)>& counts, Points2& corner_uv);

// Puts the map's cut_edges in the order of the branches, and writes the transition of each.
// `cones`: vertices. Precondition: cut_edges are edges inside the surface; the surface cut along
// them has disks as pieces. Cost: O(#F).
void write_transitions(const std::vector<VertexId>& cones, certify::Parametrization& map);

}  // namespace flipfree::seamless
