// From constraints to the target domain of phase 1, whichever kind it is.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/constraints.h"
#include "flipfree/matchmaker/target_domain.h"
#include "flipfree/matchmaker/trace_paths.h"

namespace flipfree {

struct Target {
  TargetDomain domain;  // mesh_vertex filled in
  std::vector<std::vector<VertexId>>
      given;  // mesh paths that are prescribed: along lines, and from pins to the boundary
  std::vector<Index>
      singular;  // outline places with more than 2 pi inside (turning number above 1)
};

// The outline alone: what compose.h needs. Precondition: the boundary is prescribed. Throws
// Infeasible (kNotSelfOverlapping).
Target outline_target(const RefinedSurface& surface, const Constraints& constraints,
                      const ExecutionContext& context);

// Everything: outline (or a box around the pins, for a surface with a collar), pins, lines, paths.
// In a target that overlaps itself a pin without a path must have one sheet to lie in: none is
// Infeasible (kContradictoryPins), several are InvalidInput (kBadPins; give a path).
Target full_target(const RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context);

// given[e] for every edge of the partition, from the target's list. Throws InternalError if one is
// no edge of it.
Paths given_paths(const Target& target, const ConvexPartition& partition);

}  // namespace flipfree
