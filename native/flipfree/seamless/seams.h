// The seams of a map: across each the two sides differ by a quarter turn and a translation.
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

// From the side of h to that of o, its opposite, by the middles of the edge: uv there = turned uv
// here + translation. `uv`: 3 #F x 2.
certify::Transition across(const Points2& uv, HalfedgeId h, HalfedgeId o);

// Puts the map's cut_edges in the order of their half-edges, and writes the transition of each.
// Precondition: cut_edges are different edges inside the surface. Cost: O(#F).
void write_transitions(certify::Parametrization& map);

}  // namespace flipfree::seamless
