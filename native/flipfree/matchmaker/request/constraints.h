// What the caller demands, read and checked for contradictions that can be named, each with a proof
// that others can check (docs/errors.md).
#pragma once

#include "flipfree/matchmaker/request/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// Splits chain edges of `surface` where lines have more points than vertices. Throws InvalidInput
// (kBadPins, kIndexOutOfRange, kBadBoundary, kNotFinite, kNotAnEdge) for malformed requests,
// Infeasible (kContradictoryPins, kNotSelfOverlapping) for demands that no map can meet: two
// vertices at one point, crossing lines, a pin outside the outline, an outline that runs clockwise
// or winds wrongly. Where the boundary is free and the map may overlap itself, pins and lines that
// meet are no contradiction, but nothing that is looked for: NotConverged.
Constraints read_constraints(mesh::RefinedSurface& surface, const MatchRequest& request,
                             SelfOverlaps overlaps = SelfOverlaps::kRefused);

}  // namespace flipfree::matchmaker
