// G5 of seamless maps: how many quarter turns the corners around a vertex add up to, exactly.
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

}  // namespace flipfree::certify
