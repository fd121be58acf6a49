// What a cross field is asked to follow: curvature, sharp edges, the boundary.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/field/smoothest/smoothest.h"
#include "flipfree/mesh/cut_graph/cut.h"

namespace flipfree::field {

// No wish at all.
Wishes no_wishes(Index faces);

// Principal directions, each weighing as much as the surface is curved differently along and across
// them: nothing on spheres and planes. `alignment` in [0, 1): 0 nothing, 0.5 as much as smoothness
// over a tenth of the surface's extent. Cost: O(#F).
void follow_curvature(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                      double alignment, Wishes& wishes);

// The faces beside flagged edges (mesh::flag_edges), and beside the boundary if asked. `weight` of
// a face that lies beside one, on the scale of `alignment`; 1: they are held. A face with several
// takes their mean, the longer ones weigh more. Cost: O(#F).
void follow_edges(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                  const Frames& frames, const mesh::EdgeFlags& edges, bool boundary, double weight,
                  Wishes& wishes);

}  // namespace flipfree::field
