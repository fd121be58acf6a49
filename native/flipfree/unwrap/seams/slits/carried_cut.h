// The division of a decimated surface, on the surface itself.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/decimated/decimated.h"

namespace flipfree::unwrap {

// levels: of `whole`, each of the one before. cut: of the last one's half-edges, dividing it. Every
// chain of it becomes a shortest path through the neighbourhood of what went into the vertices
// along it, which touches the boundary at its ends only. Empty where there is no such path, or
// where the paths do not make as many pieces.
mesh::EdgeFlags carried_cut(const mesh::Surface& whole, const mesh::Adjacency& adjacency,
                            const std::vector<mesh::Decimated>& levels, const mesh::EdgeFlags& cut,
                            const mesh::EdgeFlags& uncuttable, ExecutionContext& context);

}  // namespace flipfree::unwrap
