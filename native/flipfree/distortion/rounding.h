// From 64-bit UVs to the 32-bit ones that are stored, without losing what the certificate promises.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"

namespace flipfree::distortion {

struct RoundingOptions {
  // Vertices that are rounded to nearest and then never moved (pins). Their 64-bit values are
  // expected to be 32-bit numbers already.
  std::vector<VertexId> fixed;
  // The boundary may not meet itself. Precondition: it does not before rounding.
  bool bijective = false;
};

// uv: #V x 2, every triangle positively oriented by the exact test. Every value is rounded to
// nearest; where that flips or collapses a triangle (or makes the boundary meet itself) the
// vertices around are moved to other 32-bit points, over a region that grows as far as it must.
// Guarantee: every triangle is positively oriented, exactly, on the values returned; fixed vertices
// are at their rounded places. stats: "rounding.repaired" counts the vertices that are not at their
// nearest 32-bit point. Throws NotConverged (kRoundingFlips) naming the faces if no such values
// were found: the map needs more than 24 bits. Cost: O(#F), plus the repairs.
Points2f round_to_storage(const Triangles& faces, const Points2& uv, const RoundingOptions& options,
                          ExecutionContext& context, Stats& stats);

}  // namespace flipfree::distortion
