// Dual loops on a triangulation that is flipped: each stays in its homotopy class on the surface
// without its vertices, so that its holonomy angle changes with the metric only, never with a flip.
//
// A flip changes what happens inside one quadrilateral. A loop passes it from one outer side to
// another; it crosses the new diagonal if these sides lie on both sides of it, and nothing else.
#pragma once

#include <vector>

#include "flipfree/intrinsic/flip_mesh.h"
#include "flipfree/intrinsic/loops/dual_loops.h"

namespace flipfree::intrinsic {

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

}  // namespace flipfree::intrinsic
