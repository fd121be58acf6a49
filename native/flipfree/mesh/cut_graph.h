// Short cut graphs that open a connected surface into a disk or a planar piece.
//
// Handles: the loops of a tree-cotree decomposition with shortest-path tree from a root (Erickson
// and Whittlesey 2005, greedy homotopy generators), so the graph has at most 2 g loops through the
// root, each as short as the root allows. Sphere: one shortest path between two far apart vertices.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::mesh {

// Flags of edges such that the surface cut along them is connected, has genus 0 and at least one
// boundary loop; all zero if it is so already. Boundary loops are kept as they are (a loop of the
// graph may end in one). `uncuttable` (empty, or one flag per half-edge) are edges that the graph
// must not use: the diagonals of polygons. `avoided` (empty, or one flag per vertex) are vertices
// that the graph passes through only where there is no other way, such as pinned ones, which a cut
// would double; it may end in them. `cost` (empty, or one number per half-edge, both sides the
// same, positive) are what edges cost instead of their length. Precondition: one connected
// component. Throws InvalidInput if the uncuttable edges leave no way, which diagonals of polygons
// never do. Cost: O(#F log #F).
EdgeFlags planar_cut(const Surface& surface, const Adjacency& adjacency,
                     const ExecutionContext& context, const EdgeFlags& uncuttable = {},
                     const std::vector<char>& avoided = {}, const std::vector<double>& cost = {});

// The cut graph along which a cone metric is laid out: opens every component into disks with all
// cones on their boundary.
//
// Given cuts come first and stay whole. What is added is short: the surface's boundary, the given
// cuts and one cone are the sources of a shortest-path forest; a maximum spanning forest of the
// remaining dual edges (an edge weighs as much as the path that it would close) leaves over exactly
// the edges whose paths have to be cut besides those from every cone (tree-cotree; Erickson,
// Whittlesey 2005).

// `cones`: interior vertices that must lie on the graph; a cone on the boundary or on a given cut
// needs nothing. Precondition: valid surface. Result: both half-edges of every cut edge are
// flagged, boundary edges are not. Edges flagged in `avoided` (empty, or one flag per half-edge;
// the diagonals of polygons) are cut only where there is no other way. Cost: O(#F log #F).
EdgeFlags cut_to_disks(const Surface& surface, const Adjacency& adjacency, const EdgeFlags& given,
                       const std::vector<VertexId>& cones, const EdgeFlags& avoided,
                       const ExecutionContext& context);

// The faces of each piece breadth first, across edges for which crosses(h, opposite) is true: calls
// enter(h, opposite) for all but a piece's smallest face, which is reached across h.
template <typename Crosses, typename Enter>
void for_each_face_across(const Adjacency& adjacency, const Crosses& crosses, const Enter& enter) {
  std::vector<char> known(adjacency.opposite.size() / 3, 0);
  std::vector<FaceId> queue;
  for (FaceId first = 0; at(first) < known.size(); ++first) {
    if (std::exchange(known[at(first)], 1) != 0) continue;
    queue.assign(1, first);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      for (HalfedgeId h = 3 * queue[i], end = h + 3; h < end; ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (o == kInvalid || !crosses(h, o) || std::exchange(known[at(o / 3)], 1) != 0) continue;
        enter(h, o);
        queue.push_back(o / 3);
      }
    }
  }
}

}  // namespace flipfree::mesh
