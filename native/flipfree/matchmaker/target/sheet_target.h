// On which sheet of a target every pin lies: what a homotopy (outline_homotopy.h) has to know.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// A pin and the triangle (sheet) of the target in whose closure it lies.
struct SheetPin {
  PinnedVertex pin;
  FaceId face = kInvalid;
};

struct SheetTarget {
  TargetDomain domain;
  std::vector<SheetPin> pins;  // in the order of constraints.pins
};

// The outline's triangulation by its corners alone, of the disk that the paths choose if there are
// any, and for every inner pin the sheet it lies on: the only one there is, the one its path leads
// to, or the one that a line leads to from a pin or the boundary. Errors as full_target()
// (outline_target.h); a line that leaves the disk is Infeasible (kContradictoryPins).
SheetTarget sheet_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                         const ExecutionContext& context);

}  // namespace flipfree::matchmaker
