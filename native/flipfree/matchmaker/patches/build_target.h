// From constraints to the target domain of phase 1, whichever kind it is.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/patches/trace_paths.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/matchmaker/target/outline_film.h"
#include "flipfree/matchmaker/target/target_domain.h"

namespace flipfree::matchmaker {

struct Target {
  TargetDomain domain;  // mesh_vertex filled in
  std::vector<std::vector<VertexId>>
      given;  // mesh paths that are prescribed: along lines, and from pins to the boundary
  std::vector<Index>
      singular;  // outline places with more than 2 pi inside (turning number above 1)
};

// The outline alone: what compose.h needs. Precondition: the boundary is prescribed. Throws
// Infeasible (kNotSelfOverlapping).
Target outline_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                      const ExecutionContext& context);

// Everything: outline (or a box around the pins, for a surface with a collar), pins, lines, paths.
// In a target that overlaps itself a pin without a path must have one sheet to lie in: none is
// Infeasible (kContradictoryPins), several are InvalidInput (kBadPins; give a path).
Target full_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context);

// For outline_film.h: the outline's triangulation by its corners alone, of the disk that the paths
// choose if there are any, and for every inner pin the sheet it lies on: the only one there is, the
// one its path leads to, or the one that a line leads to from a pin or the boundary. Errors as
// full_target(); a line that leaves the disk is Infeasible (kContradictoryPins).
struct SheetTarget {
  TargetDomain domain;
  std::vector<SheetPin> pins;  // in the order of constraints.pins
};
SheetTarget sheet_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                         const ExecutionContext& context);

// given[e] for every edge of the partition, from the target's list. Throws InternalError if one is
// no edge of it.
Paths given_paths(const Target& target, const ConvexPartition& partition);

}  // namespace flipfree::matchmaker
