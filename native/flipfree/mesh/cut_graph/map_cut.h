// The cut graph along which a cone metric is laid out: opens every component into disks with all
// cones on their boundary.
//
// Given cuts come first and stay whole. What is added is short: the surface's boundary, the given
// cuts and one cone are the sources of a shortest-path forest; a maximum spanning forest of the
// remaining dual edges (an edge weighs as much as the path that it would close) leaves over exactly
// the edges whose paths have to be cut besides those from every cone (tree-cotree; Erickson,
// Whittlesey 2005).
#pragma once

#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut_graph/cut.h"

namespace flipfree::mesh {

// `cones`: interior vertices that must lie on the graph; a cone on the boundary or on a given cut
// needs nothing. Precondition: valid surface. Result: both half-edges of every cut edge are
// flagged, boundary edges are not. Edges flagged in `avoided` (empty, or one flag per half-edge;
// the diagonals of polygons) are cut only where there is no other way. Cost: O(#F log #F).
EdgeFlags cut_to_disks(const Surface& surface, const Adjacency& adjacency, const EdgeFlags& given,
                       const std::vector<VertexId>& cones, const EdgeFlags& avoided,
                       const ExecutionContext& context);

// Empty if the cut is what cut_to_disks() promises: both half-edges of a cut edge flagged, none on
// the boundary, every piece a disk, every interior cone on the cut. Otherwise what is broken. Cost:
// O(#F).
std::string find_broken_disks(const Surface& surface, const Adjacency& adjacency,
                              const EdgeFlags& cut, const std::vector<VertexId>& cones);

}  // namespace flipfree::mesh
