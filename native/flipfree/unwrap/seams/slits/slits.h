// Slits that let a chart be laid flat within a bound of distortion, without dividing it.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/seams/search/search.h"

namespace flipfree::unwrap {

// cost: per half-edge, both sides the same, infinite where no slit may run. Slits run along
// shortest paths from the boundary, or from other slits, to where the chart's conformal map would
// change lengths most (hills.h), as many as it takes for the least distorted map to have a mean
// energy of at most the bound; fewer where time is over or nothing is left to be slit. Holes whose
// border turns are opened to the outside first. Large charts are searched by few of their vertices
// (carried_slits.h). Precondition: connected, planar; with a boundary, or closed.
Slits find_slits(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                 const std::vector<double>& cost, const SlitOptions& options,
                 ExecutionContext& context);

}  // namespace flipfree::unwrap
