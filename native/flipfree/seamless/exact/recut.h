// A seamless map of a refined surface, written on the user's own triangles.
//
// Where cuts pass through the user's faces, no face has its corners in one chart. But a seamless
// map is a local thing: the refined faces of one parent are brought into one frame, across seams
// by their quarter turns and translations; so are the frames of neighbours, and the user's surface
// is cut and laid out anew.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// `map`: of `input`, a closed surface, seamless up to rounding, with cut_edges and provenance.
// `cones`: vertices of the input that the new cut must reach. `avoided`: see mesh::cut_to_disks().
// Result: the input's own triangles, corners where `map` has them but for one motion per component,
// seams that match up to rounding; faces that the map bends may be flipped. No certificate. Cost:
// O(#F log #F).
certify::Parametrization on_own_triangles(const mesh::Surface& input,
                                          const mesh::Adjacency& adjacency,
                                          const std::vector<VertexId>& cones,
                                          const mesh::EdgeFlags& avoided,
                                          const certify::Parametrization& map,
                                          const ExecutionContext& context);

}  // namespace flipfree::seamless
