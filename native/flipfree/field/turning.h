// What is topological about a cross field: cones and turning numbers, counted in whole quarter
// turns from its matching alone. No angle is looked at, so nothing is rounded.
//
// Along a dual loop (intrinsic/loops.h) a flat metric that the field is parallel in
// turns by (sum of signed corner angles) + (sum of rotations across). Angles of the field and
// directions of edges cancel in that sum; what stays are the matchings, and 2 quarter turns with a
// sign for every corner: that of (direction(out) - direction(in) -+ corner) = +- pi. So turning
// numbers are the holonomy numbers of thesis 6.2 that a map must have to follow the field.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/cross_field.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::field {

// On the surface's faces: half-edges 3 f + k.
using intrinsic::DualLoop;
using intrinsic::LoopTurn;

// Quarter turns k of the total angle of every vertex: 4 where the field is regular. On the boundary
// those of the field between the two boundary edges, each taken for the nearest of its directions:
// 2 where it goes straight on. Their sum along a boundary loop depends on the matching alone.
// 4 and 2 at vertices without faces. Cost: O(#F).
std::vector<Index> cone_turns(const Triangles& faces, const mesh::Adjacency& adjacency,
                              const Frames& frames, const CrossField& field);

// What a strip adds to the turn of a loop in the face that it enters by the half-edge `entered` of
// that face and leaves by another one of it, without the matching across.
Index turn_at_corner(HalfedgeId entered, HalfedgeId leaving);

// Precondition: a closed strip that does not turn back. Cost: O(loop).
Index turning_number(const mesh::Adjacency& adjacency, const CrossField& field,
                     const DualLoop& loop);

// The strips of faces along each boundary loop, which runs on their right hand, in the order of
// mesh::boundary_loops(); empty where the strip shrinks to a point. Cost: O(#F).
std::vector<DualLoop> boundary_strips(const Triangles& faces, const mesh::Adjacency& adjacency);

struct Signature {
  std::vector<Index> cones;     // #V
  std::vector<LoopTurn> loops;  // 2 g of a homology basis, then those along the boundary
};

// Of all components. Precondition: a valid surface. Cost: O(#F log #F) and the loops.
Signature signature_of(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                       const Frames& frames, const CrossField& field,
                       const ExecutionContext& context);

}  // namespace flipfree::field
