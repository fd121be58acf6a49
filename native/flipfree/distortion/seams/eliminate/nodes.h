// From the free coordinates of a seamless map to the map, and back.
#pragma once

#include "flipfree/distortion/seams/eliminate/constraints.h"

namespace flipfree::distortion {

// The nodes of a map that meets the constraints up to rounding: translations are the means over
// their seam edges' ends, lines those over their vertices.
Points2 nodes_of(const SeamConstraints& constraints, const Triangles& faces,
                 const std::vector<SeamEdge>& seams, const Points2& uv);
// The map of given nodes, in floating point.
Points2 map_of(const SeamConstraints& constraints, const Points2& nodes);

}  // namespace flipfree::distortion
