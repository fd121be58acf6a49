// Loops on the user's faces as loops of the intrinsic mesh that was built of them.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/flip_mesh.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

// Closed strips of triangles that generate the homology of a closed surface, or of a part of one
// that barriers enclose.
//
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

// 2 g loops, each without a face twice, that generate the first homology of a closed connected
// surface: the fundamental cycles of a tree-cotree decomposition (Eppstein 2003; Erickson and
// Whittlesey 2005) whose dual tree is one of shortest paths and whose primal tree spares the edges
// with the shortest cycles. `step`: per edge, how far it is from face to face across it (> 0).
// Edges with an infinite step are barriers: no loop crosses them. Where they enclose the part that
// the first face lies in, the 2 g loops are those of that part with every curve of barriers
// contracted to a point. Cost: O(#F log #F) plus the loops.
std::vector<DualLoop> homology_basis(const FlipMesh& mesh, const std::vector<double>& step,
                                     const ExecutionContext& context);

// Shortest strips from one closed curve of barriers to each other one, through the part that the
// first face lies in. A strip begins with the half-edge by which it comes in from beyond the first
// curve and ends with the one that leaves across the other. Cost: as homology_basis().
std::vector<DualLoop> boundary_strips(const FlipMesh& mesh, const std::vector<double>& step,
                                      const ExecutionContext& context);

// Algebraic number of crossings of a loop with another one pushed off it; both in the same mesh.
// The matrix over a homology basis has determinant 1.
Index intersection_number(const FlipMesh& mesh, const DualLoop& a, const DualLoop& b);

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

// Per edge of the mesh: the way between the centres of the two triangles beside it, over the middle
// of the edge; positive. What homology_basis() takes for lengths. Cost: O(#F).
std::vector<double> steps_across(const mesh::Surface& surface, const IntrinsicSetup& setup);

// The same, infinite at the boundary of the surface and beyond: a barrier (dual_loops.h).
std::vector<double> steps_inside(const mesh::Surface& surface, const IntrinsicSetup& setup);

// A strip from boundary to boundary (boundary_strips()) followed by its mirror image: a loop of the
// double cover.
DualLoop closed_by_reflection(const IntrinsicMesh& mesh, const DualLoop& strip);

// `loops`: half-edges 3 f + k of the faces. Throws InvalidInput (kBadOption) naming the loop, and
// the place in it, that is no closed strip of faces.
std::vector<DualLoop> on_setup(const std::vector<DualLoop>& loops, const Triangles& faces,
                               const IntrinsicSetup& setup);

}  // namespace flipfree::intrinsic
