// Inner edges that an aligned boundary would flatten.
//
// An edge whose two ends lie on one straight side of the boundary, and the side between them, end
// up on one line: what they enclose has no area, whatever the map. So it is with every triangle
// that has a tip at a straight vertex. A vertex on the middle of each of these edges is as much
// refinement as that needs, and as little.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// One half-edge of each inner edge that cuts a disk off the surface, in which no vertex of the
// boundary is a corner. `cones`: 2 at boundary vertices that are straight; any number of
// components. Throws Cancelled. Cost: sorting them, and what lies between a disk and the disks in
// it; only small disks are looked for.
std::vector<HalfedgeId> side_chords(const Triangles& faces, const mesh::Adjacency& adjacency,
                                    const std::vector<Index>& cones, ExecutionContext& context);

struct DividedSurface {
  mesh::Surface surface;        // the input's vertices first
  mesh::Provenance provenance;  // on the input
  std::vector<Index> cones;     // per vertex
};

// A vertex on the middle of each of these inner edges, the i-th one's after the surface's own
// vertices and the i before; flat. Faces without such an edge stay as they are. Throws NotConverged
// naming an edge that is so short that there is no number between its ends, or a face so thin that
// the middles of two sides fall together.
DividedSurface split_in_the_middle(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                   const std::vector<HalfedgeId>& edges,
                                   const std::vector<Index>& cones);

}  // namespace flipfree::seamless
