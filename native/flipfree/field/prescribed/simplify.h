// Fewer and gentler cones: near pairs that cancel are merged, cones of one quarter turn share their
// curvature with a neighbour. Quarter turns are moved along chains of edges, so that the rest of
// the signature stays as it is (prescribed.h).
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/field/topology/cross_field.h"

namespace flipfree::field {

struct SimplifyOptions {
  double reach = 0.05;    // pairs nearer than this share of the square root of the area cancel
  Index least_turns = 2;  // cones of fewer quarter turns are spread
};

struct Simplified {
  Index cancelled = 0;  // quarter turns that were moved between cones of opposite sign
  Index spread = 0;     // quarter turns that were moved to a vertex that was regular
};

// Changes the matching, and the directions to the smoothest that go with it, but for faces that are
// `held` (flags). Nothing moves across the boundary, or along edges whose faces are both held.
// Cost: a search around every cone, and a factorization if anything was moved.
Simplified simplify(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                    const Frames& frames, const std::vector<char>& held,
                    const SimplifyOptions& options, CrossField& field, ExecutionContext& context);

}  // namespace flipfree::field
