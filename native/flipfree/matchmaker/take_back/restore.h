// Takes refinement back where the triangles of the input have to be untangled for it: piece by
// piece, each within a small neighbourhood whose rim does not move.
//
// A piece is a set of refined input faces that share split edges; whole again, some of its faces
// are turned over. Untangling (untangle.h) the piece and some rings around it often finds places
// for their vertices at which none is, although it would not for the whole map at once.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// `held`: #V, vertices that must not move. Vertices below `keep` are not removed; pieces with
// vertices between the input's and `keep` are left alone. The map stays valid, interior vertices go
// on winding once. Returns the number of vertices removed, which stay as isolated ones until
// compacted. Cost: a few Newton steps on each neighbourhood of `rings` rings.
Index restore_pieces(mesh::RefinedMap& map, const std::vector<char>& held, Index keep, int rings,
                     ExecutionContext& context);

}  // namespace flipfree::matchmaker
