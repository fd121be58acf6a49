// G5 and G6 of seamless maps: how many quarter turns the corners around a vertex, or along a strip
// of faces, add up to, exactly.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"

namespace flipfree::certify {

// Per vertex: k where the corners' angles add up to k pi/2, kInvalid on the boundary and for
// vertices without a face. Precondition: no flipped face, and every cut edge related by an exact
// quarter turn: then the sum is a whole number of quarter turns, which is the number of quadrants
// that the directions around the vertex enter; turning by quarters changes no such count, so that
// cuts need not be developed. Comparisons of coordinates only. Cost: O(#F).
std::vector<Index> quarter_turns_around(const mesh::Adjacency& adjacency, const Points2& corner_uv);

// The same along a closed strip of faces that does not turn back, half-edges 3 f + k each left
// across it: corners on its left hand less those on its right, so that turning to the left counts
// positive. kNoStrip if the half-edges are no such strip. Cost: O(strip).
inline constexpr Index kNoStrip = -(1 << 30);
Index quarter_turns_along(const mesh::Adjacency& adjacency, const Points2& corner_uv,
                          const std::vector<HalfedgeId>& strip);

}  // namespace flipfree::certify
