// From constraints to the target domain of phase 1 of MatchMaker++: embedded, or immersed where the
// outline overlaps itself.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

struct Target {
  TargetDomain domain;  // mesh_vertex filled in
  std::vector<std::vector<VertexId>>
      given;  // mesh paths that are prescribed: along lines, and from pins to the boundary
  std::vector<Index>
      singular;  // outline places with more than 2 pi inside (turning number above 1)
};

// The constraints without pins, lines and paths.
Constraints outline_alone(const Constraints& constraints);

// A simple outline, or a box around the pins for a surface with a collar and a free boundary, with
// all pins and lines in it.
Target embedded_target(const mesh::RefinedSurface& surface, const Constraints& constraints);

// An outline that overlaps itself, with a slit to every pin that has a path. Throws Infeasible
// (kNotSelfOverlapping), or NotConverged with that code where the slits may be at fault.
Target immersed_outline(const mesh::RefinedSurface& surface, const Constraints& constraints,
                        const ExecutionContext& context);

// Refuses a pin at which not one sheet but so many lie: none is Infeasible (kContradictoryPins),
// several are InvalidInput (kBadPins).
[[noreturn]] void refuse_sheets(const PinnedVertex& pin, std::size_t sheets,
                                const Constraints& constraints);

// Infeasible (kContradictoryPins) if the pin lies on a corner or a fixed edge of its triangle.
void check_off_edges(const TargetDomain& domain, const PinnedVertex& pin, FaceId sheet);

// Everything: outline (or a box around the pins, for a surface with a collar), pins, lines, paths.
// In a target that overlaps itself a pin without a path must have one sheet to lie in: none is
// Infeasible (kContradictoryPins), several are InvalidInput (kBadPins; give a path).
Target full_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context);

}  // namespace flipfree::matchmaker
