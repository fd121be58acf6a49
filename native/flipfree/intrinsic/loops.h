// Loops on the user's faces as loops of the intrinsic mesh that was built of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
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

// A tree of shortest paths from face to face across edges, and the edges that neither it nor a
// spanning tree of the vertices takes: one for each loop of a homology basis (tree-cotree
// decomposition: Eppstein 2003; Erickson and Whittlesey 2005).
//
// `Dual` is any mesh: face_count(), face_of(h), opposite(h) (kInvalid at a boundary), step(h) (how
// far it is across, infinite at barriers, which nothing crosses), for_each_side(f, visit).

struct DualTree {
  std::vector<double> distance;     // per face, infinite where it does not reach
  std::vector<HalfedgeId> entered;  // crossed last, in the face before; kInvalid at roots
  std::vector<Index> depth;         // edges to the root
};

// From the first face of every component, or of the first one alone. Cost: O(#F log #F).
template <typename Dual>
DualTree dual_tree(const Dual& dual, bool all_components, const ExecutionContext& context) {
  const std::size_t count = dual.face_count();
  constexpr double kFar = std::numeric_limits<double>::infinity();
  DualTree tree{std::vector<double>(count, kFar), std::vector<HalfedgeId>(count, kInvalid),
                std::vector<Index>(count, 0)};
  using Entry = std::pair<double, FaceId>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  std::size_t done = 0;
  for (FaceId root = 0; at(root) < (all_components ? count : 1); ++root) {
    if (tree.distance[at(root)] < kFar) continue;
    tree.distance[at(root)] = 0.0;
    queue.push({0.0, root});
    while (!queue.empty()) {
      const auto [distance, f] = queue.top();
      queue.pop();
      if (distance > tree.distance[at(f)]) continue;
      if (++done % 4096 == 0) context.check();
      dual.for_each_side(f, [&, distance = distance, f = f](HalfedgeId h) {
        const HalfedgeId o = dual.opposite(h);
        if (o == kInvalid) return;
        const FaceId other = dual.face_of(o);
        const double further = distance + dual.step(h);
        if (!(further < tree.distance[at(other)])) return;
        tree.distance[at(other)] = further;
        tree.entered[at(other)] = h;
        tree.depth[at(other)] = tree.depth[at(f)] + 1;
        queue.push({further, other});
      });
    }
  }
  return tree;
}

// Calls take(h) for one half-edge of every edge that the tree does not cross, those first whose
// loops are long: what a spanning tree of the vertices takes in this order leaves the short ones.
template <typename Dual, typename Take>
void for_each_uncrossed(const Dual& dual, const DualTree& tree, HalfedgeId halfedges,
                        const Take& take) {
  std::vector<char> crossed(at(halfedges), 0);
  for (const HalfedgeId h : tree.entered) {
    if (h != kInvalid) crossed[at(h)] = crossed[at(dual.opposite(h))] = 1;
  }
  std::vector<std::pair<double, HalfedgeId>> edges;
  for (HalfedgeId h = 0; h < halfedges; ++h) {
    const HalfedgeId o = dual.opposite(h);
    if (o < h || crossed[at(h)] != 0) continue;
    const double left = tree.distance[at(dual.face_of(h))];
    const double right = tree.distance[at(dual.face_of(o))];
    if (std::isfinite(std::min(left, right))) edges.emplace_back(left + right + dual.step(h), h);
  }
  std::sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  for (const auto& [length, h] : edges) take(length, h);
}

// The half-edges that are crossed on the way from face `a` to face `b` of one component through the
// tree, without what the ways to both share.
struct TreePath {
  std::vector<HalfedgeId> up;    // in order, towards the root
  std::vector<HalfedgeId> down;  // in order, away from it
};
template <typename Dual>
TreePath path_between(const Dual& dual, const DualTree& tree, FaceId a, FaceId b) {
  TreePath path;
  const auto up = [&](FaceId& f) {
    const HalfedgeId entered = tree.entered[at(f)];
    f = dual.face_of(entered);
    return entered;
  };
  while (a != b) {
    if (tree.depth[at(a)] >= tree.depth[at(b)]) {
      path.up.push_back(dual.opposite(up(a)));
    } else {
      path.down.push_back(up(b));
    }
  }
  std::reverse(path.down.begin(), path.down.end());
  return path;
}

// From the tree's root across h and back, without what both ways share.
template <typename Dual>
std::vector<HalfedgeId> loop_across(const Dual& dual, const DualTree& tree, HalfedgeId h) {
  const TreePath path = path_between(dual, tree, dual.face_of(dual.opposite(h)), dual.face_of(h));
  std::vector<HalfedgeId> loop = path.down;
  loop.push_back(h);
  loop.insert(loop.end(), path.up.begin(), path.up.end());
  return loop;
}

}  // namespace flipfree::intrinsic
