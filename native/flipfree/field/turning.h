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

// Loops that generate the homology of a surface, on its faces and along its edges, each of the ones
// crossing one of the others (Eppstein 2003; Erickson, Whittlesey 2005).
//
// A tree of shortest paths joins the faces of each component across edges; a tree of edges that it
// does not cross joins the vertices, those of a boundary loop taken as one. 2 g edges are left
// over: each closes one loop of faces and one chain of edges. Unlike intrinsic/loops it works on
// the surface's own half-edges, with boundaries and with several components.

// Half-edges 3 f + k, head to tail; at a boundary loop it may end at one vertex and go on at
// another.
using EdgeChain = std::vector<HalfedgeId>;

struct TreeCotree {
  std::vector<intrinsic::DualLoop> loops;  // 2 g, without a face twice
  std::vector<HalfedgeId> left_over;       // the edge that closes each
  // Per vertex: the half-edge of the tree that leads to its parent; kInvalid at roots, and at all
  // vertices of a boundary loop but one.
  std::vector<HalfedgeId> to_parent;
  // Vertices in an order in which parents come first.
  std::vector<VertexId> order;
  // Per vertex: itself, or the vertex that stands for its boundary loop.
  std::vector<VertexId> stands_for;
};

// Precondition: a valid surface. Cost: O(#F log #F) and the loops.
TreeCotree tree_cotree(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                       const ExecutionContext& context);

// The chain of tree edges from what one vertex stands for to what another one does, of the same
// component. Cost: O(its length + depth of the tree).
EdgeChain tree_path(const Triangles& faces, const mesh::Adjacency& adjacency,
                    const TreeCotree& tree, VertexId from, VertexId to);

// The closed chain of edges through left_over[i]. It crosses loops[i] once, from the right of it to
// its left, and no other loop. Cost: O(its length + depth of the tree).
EdgeChain chain_of(const Triangles& faces, const mesh::Adjacency& adjacency, const TreeCotree& tree,
                   std::size_t i);

}  // namespace flipfree::field
