// The cones and turns that a map must have to follow a cross field, on surfaces with and without
// boundary.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/cross_field.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::holonomy {

struct NeededTopology {
  // Per vertex, quarter turns. At boundary vertices those between the edges, each taken for the
  // nearest of the field's directions; aligned: corners that no map has, and pairs of neighbours of
  // which one bends in and the other out, are evened out, so that none is less than 1.
  std::vector<Index> cones;
  // As compute_penner_metric() takes them: of each component a homology basis, with its boundaries
  // contracted, and where these are aligned strips from one to each other one.
  std::vector<intrinsic::LoopTurn> loops;
};

// Precondition: a valid surface. Throws Cancelled. Cost: O(#F log #F).
NeededTopology needed_topology(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                               const field::CrossField& field, bool aligned,
                               const ExecutionContext& context);

}  // namespace flipfree::holonomy
