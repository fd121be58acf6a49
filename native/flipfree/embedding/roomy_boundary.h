// A circle for a disk's boundary, with room where the disk's own edges need it.
//
// An edge between two boundary vertices is a chord, fixed by its ends. Where vertices are many the
// circle turns between the ends of short chords by less than 32 bits can tell: the tip of a strip
// of 100 000 squares, spaced by length, is 1600 chords one behind the other between points that lie
// on one line as stored. There the points have to be further apart.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/embedding/disk/disk.h"

namespace flipfree::embedding {

// place_boundary(), but of a circle the edges beyond chords without room (chords.h) get twice as
// much of it until all have room; positions that 32 bits cannot keep in strictly convex order are
// 64-bit numbers then. Where that does not come to an end, and for other shapes:
// place_boundary()'s. loop: the boundary vertices in order; lengths as place_boundary() has them.
// Throws what that does, Cancelled. Cost: O(#F) for each doubling, none as a rule.
Points2 place_with_room(BoundaryShape shape, const std::vector<double>& lengths,
                        const Triangles& faces, Index vertex_count,
                        const std::vector<VertexId>& loop, const ExecutionContext& context);

}  // namespace flipfree::embedding
