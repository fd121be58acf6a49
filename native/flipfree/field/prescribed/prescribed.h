// A cross field with the cones and turning numbers that are asked for, exactly: integers first,
// then the smoothest directions that go with them (relax.h).
//
// Across edges along a chain the matching may be raised by one: the chain's first vertex loses a
// quarter turn, its last one gains it, and every loop that it crosses turns by one more. Chains of
// a tree of edges bring every vertex to its number, closed chains every loop (tree_cotree.h).
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/prescribed/relax.h"
#include "flipfree/field/topology/turning.h"

namespace flipfree::field {

// `cones`: quarter turns per vertex, 4 where the field is regular. `loops`: with their turns; they
// generate the homology of each component; none: the turns that need the least rotation.
// Precondition: a valid closed surface. Throws Infeasible (kGaussBonnet) naming what is missing on
// a component, InvalidInput (kBadOption: loops that are no closed strips of faces, that are not
// independent or too few), NotConverged, Cancelled. Cost: a factorization, O(genus) solutions.
CrossField field_with_signature(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                const Frames& frames, const std::vector<Index>& cones,
                                const std::optional<std::vector<LoopTurn>>& loops,
                                ExecutionContext& context);

// Raises the matching along a chain of half-edges, head to tail, by so much.
void add_along(const mesh::Adjacency& adjacency, const std::vector<HalfedgeId>& chain, Index by,
               CrossField& field);

}  // namespace flipfree::field
