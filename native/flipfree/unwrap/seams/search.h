// Slits that let a chart be laid flat within a bound of distortion, without dividing it.
#pragma once

#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

// No bound; and how much a map is stretched that has a flipped or degenerate face.
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Infinite where a face is flipped or degenerate. corner_uv: 3 #F x 2. Cost: O(#F).
Stretch stretch_of(const mesh::Surface& surface, const Points2& corner_uv);

struct Slits {
  mesh::EdgeFlags cut;   // of the chart's half-edges
  Points2 corner_uv;     // a map of the chart cut along `cut`; empty if there is none
  bool divided = false;  // the map lies on itself; `cut` divides the chart
  Stretch stretch;       // of the map
};

// cost: per half-edge, both sides the same, infinite where no slit may run. Slits run along
// shortest paths from the boundary, or from other slits, to where the chart's conformal map would
// change lengths most (Hill), as many as it takes for the least distorted map to have a mean
// energy of at most the bound; fewer where time is over or nothing is left to be slit. Holes whose
// border turns are opened to the outside first. Large charts are decimated and
// searched by few of their vertices; every slit found there becomes a shortest path of the chart
// through the neighbourhood of what went into the vertices along it. Precondition: connected,
// planar; with a boundary, or closed.
//
// Of the options: bijective, may_add_cuts (a chart that would lie on itself may be divided), and
// acceptable (accept() ends the search where the slits will do, context.h).
Slits find_slits(const mesh::Surface& chart, const std::vector<double>& cost, const Stretch& bound,
                 const UnwrapOptions& options, ExecutionContext& context);

}  // namespace flipfree::unwrap
