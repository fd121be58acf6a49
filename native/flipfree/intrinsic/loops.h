// Loops on the user's faces as loops of the intrinsic mesh that was built of them.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

// A dual loop is a cyclic sequence of half-edges: the loop leaves the face of loop[i] across it,
// and the next face across loop[i + 1]. It does not turn back (loop[i + 1] is never the opposite of
// loop[i]). In the face that it enters across o = opposite(loop[i]) it passes one corner:
//
//       loop[i + 1] = next(o): the corner at the source of loop[i + 1] lies on its right hand,
//       loop[i + 1] = previous(o): the corner at the source of o lies on its left hand.
//
// Its holonomy angle is the sum of the angles of these corners, left ones positive, right ones
// negative (thesis 6.2): how much it turns to the left, as seen by parallel transport.

using DualLoop = std::vector<HalfedgeId>;

// A loop, and by how much it turns or is to turn.
struct LoopTurn {
  DualLoop loop;
  Index quarter_turns = 0;  // to the left
  // A strip from one boundary to another: the first half-edge is that of the boundary at which it
  // begins, its turn that from the one straight boundary to the other.
  bool between_boundaries = false;
};

// A strip that goes on across `side`, which is none at all where that turns back; and one whose
// ends are joined, without what turns back there. `opposite`: per half-edge.
void go_across(DualLoop& strip, HalfedgeId side, const std::vector<HalfedgeId>& opposite);
void close_strip(DualLoop& strip, const std::vector<HalfedgeId>& opposite);

// Loops that generate the homology of a surface, on its faces and along its edges, each of the ones
// crossing one of the others (Eppstein 2003; Erickson, Whittlesey 2005).
//
// A tree of shortest paths joins the faces of each component across edges; a tree of edges that it
// does not cross joins the vertices, those of a boundary loop taken as one, and spares the edges
// with the shortest loops. 2 g edges are left over: each closes one loop of faces and one chain of
// edges.

// Half-edges 3 f + k, head to tail; at a boundary loop it may end at one vertex and go on at
// another.
using EdgeChain = std::vector<HalfedgeId>;

struct TreeCotree {
  std::vector<DualLoop> loops;        // 2 g, without a face twice
  std::vector<HalfedgeId> left_over;  // the edge that closes each
  // Per vertex: the half-edge of the tree that leads to its parent; kInvalid at roots, and at all
  // vertices of a boundary loop but one.
  std::vector<HalfedgeId> to_parent;
  // Vertices in an order in which parents come first.
  std::vector<VertexId> order;
  // Per vertex: itself, or the vertex that stands for its boundary loop.
  std::vector<VertexId> stands_for;
};

// Tree paths run from centre to centre of faces, over the middles of edges. Precondition: a valid
// surface. Cost: O(#F log #F) and the loops.
TreeCotree tree_cotree(const mesh::Surface& surface, const ExecutionContext& context);

// The chain of tree edges from what one vertex stands for to what another one does, of the same
// component. Cost: O(its length + depth of the tree).
EdgeChain tree_path(const mesh::Surface& surface, const TreeCotree& tree, VertexId from,
                    VertexId to);

// The closed chain of edges through left_over[i]. It crosses loops[i] once, from the right of it to
// its left, and no other loop. Cost: O(its length + depth of the tree).
EdgeChain chain_of(const mesh::Surface& surface, const TreeCotree& tree, std::size_t i);

// Shortest strips from the first boundary loop of a connected surface to each other one: half-edges
// as of a loop, before them that of the boundary at which the strip begins. Cost: as tree_cotree().
std::vector<DualLoop> strips_between(const mesh::Surface& surface, const ExecutionContext& context);

// Dual loops on a triangulation that is flipped: each stays in its homotopy class on the surface
// without its vertices, so that its holonomy angle changes with the metric only, never with a flip.
//
// A flip changes what happens inside one quadrilateral. A loop passes it from one outer side to
// another; it crosses the new diagonal if these sides lie on both sides of it, and nothing else.

// A corner that a loop passes: that opposite half-edge `opposite`, on its left or right hand.
struct PassedCorner {
  HalfedgeId opposite;
  double sign;  // +1 left, -1 right
};

class LoopCarrier {
 public:
  LoopCarrier(FlipMesh mesh, const std::vector<DualLoop>& loops);

  // Precondition: the two sides of the edge are different faces. Cost: O(crossings of the five
  // edges).
  void flip(EdgeId e);

  const FlipMesh& mesh() const { return mesh_; }
  std::size_t size() const { return first_.size(); }
  DualLoop loop(std::size_t i) const;
  // The corners that loop i passes, in order.
  template <typename Visit>
  void visit_corners(std::size_t i, Visit visit) const {
    Index node = first_[i];
    do {
      const Node& n = nodes_[static_cast<std::size_t>(node)];
      const HalfedgeId entered = FlipMesh::opposite(n.halfedge);
      const HalfedgeId leaving = nodes_[static_cast<std::size_t>(n.next)].halfedge;
      const HalfedgeId after = mesh_.next_of(entered);
      if (leaving == after) {
        visit(PassedCorner{mesh_.next_of(after), -1.0});
      } else {
        visit(PassedCorner{after, 1.0});
      }
      node = n.next;
    } while (node != first_[i]);
  }

 private:
  // A crossing of a loop with an edge: in the loop's cyclic list, and in the edge's.
  struct Node {
    HalfedgeId halfedge = kInvalid;
    Index loop = kInvalid;
    Index next = kInvalid, previous = kInvalid;  // along the loop
    Index above = kInvalid, below = kInvalid;    // on the edge
  };
  Index insert(HalfedgeId h, Index loop, Index after);
  void remove(Index node);
  void cross_new_diagonal(HalfedgeId side, HalfedgeId diagonal);

  FlipMesh mesh_;
  std::vector<Node> nodes_;
  std::vector<Index> unused_;
  std::vector<Index> on_edge_;  // per edge: its first crossing
  std::vector<Index> first_;    // per loop: one of its crossings
};

// A strip from boundary to boundary, its first half-edge the one by which it comes in from the
// mirror image, followed by its own mirror image: a loop of the double cover.
DualLoop closed_by_reflection(const IntrinsicMesh& mesh, const DualLoop& strip);

// `loops`: half-edges 3 f + k of the faces. Throws InvalidInput (kBadOption) naming the loop, and
// the place in it, that is no closed strip of faces.
std::vector<DualLoop> on_setup(const std::vector<DualLoop>& loops, const Triangles& faces,
                               const IntrinsicSetup& setup);

}  // namespace flipfree::intrinsic
