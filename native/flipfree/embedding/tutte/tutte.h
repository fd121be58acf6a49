// Tutte's embedding of a disk (Tutte 1963, Floater 1997): boundary fixed on a convex polygon, every
// inner vertex a positive convex combination of its neighbours.
//
// Guarantee: in exact arithmetic a bijection, if the polygon is convex and no inner edge joins two
// vertices of one side. In floating point it may fold over (thesis 3.2.1); callers check with
// is_flip_free and climb the ladder of embed.h.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::embedding {

// Weight 1 on every edge; one Cholesky factorization. Returns #V x 2; isolated vertices get (0, 0).
Points2 tutte_uniform(const Triangles& faces, Index vertex_count, const std::vector<VertexId>& loop,
                      const Points2& boundary, ExecutionContext& context);

}  // namespace flipfree::embedding
