// The surface cut open along an admissible cut, and the angles that its pieces shall have there.
#pragma once

#include <vector>

#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/seamless/padding/segments.h"

namespace flipfree::seamless {

struct OpenCut {
  mesh::CutMesh mesh;
  std::vector<double> angle;  // per vertex of it, total, radians: cones, straight sides, corners
};

// `adjacency`, `segments`: of the cut. `cones`: quarter turns per vertex of cut.surface. Cost:
// O(#F).
OpenCut open_cut(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                 const CutSegments& segments, const std::vector<Index>& cones);

}  // namespace flipfree::seamless
