// Short cut graphs that open a connected surface into a disk or a planar piece.
//
// Handles: the loops of a tree-cotree decomposition with shortest-path tree from a root (Erickson
// and Whittlesey 2005, greedy homotopy generators), so the graph has at most 2 g loops through the
// root, each as short as the root allows. Sphere: one shortest path between two far apart vertices.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut_graph/cut.h"

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

}  // namespace flipfree::mesh
