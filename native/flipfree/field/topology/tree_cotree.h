// Loops that generate the homology of a surface, on its faces and along its edges, each of the ones
// crossing one of the others (Eppstein 2003; Erickson, Whittlesey 2005).
//
// A tree of shortest paths joins the faces of each component across edges; a tree of edges that it
// does not cross joins the vertices, those of a boundary loop taken as one. 2 g edges are left
// over: each closes one loop of faces and one chain of edges. Unlike intrinsic/loops it works on
// the surface's own half-edges, with boundaries and with several components.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/loops/dual_loops.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::field {

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

// The closed chain of edges through left_over[i]. It crosses loops[i] once, from the right of it to
// its left, and no other loop. Cost: O(its length + depth of the tree).
EdgeChain chain_of(const Triangles& faces, const mesh::Adjacency& adjacency, const TreeCotree& tree,
                   std::size_t i);

}  // namespace flipfree::field
