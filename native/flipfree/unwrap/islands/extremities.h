// Where an automatic cut is too short: the extremities of a chart (fingers, legs, horns), which a
// flat map would have to shrink by orders of magnitude.
//
// They are found from the scale factor of the conformal map that keeps the length of the boundary:
// u = 0 there, and (cotan Laplacian) u = angle defect inside, one sparse solve (Ben-Chen, Gotsman,
// Bunin 2008, who place cones at its extrema; here they become ends of slits, as in Gu, Gortler and
// Hoppe 2002, where the largest distortion of a map says where its cut has to grow).
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::unwrap {

// Flags of edges: slits along shortest paths from the boundary, or from earlier slits, to every
// peak of |u| that is high and stands out; all zero where a flat map is mild without them. The
// chart cut along them stays connected and planar. `uncuttable` as in planar_cut(). Precondition:
// connected, planar, with a boundary. Cost: a few rounds of one factorization with #V unknowns and
// O(#F log #F).
mesh::EdgeFlags cut_to_extremities(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                                   const mesh::EdgeFlags& uncuttable, ExecutionContext& context);

}  // namespace flipfree::unwrap
