// From constraints to the target domain of phase 1 of MatchMaker++: embedded, or immersed where the
// outline overlaps itself.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/target_domain.h"

namespace flipfree::matchmaker {

struct Target {
  TargetDomain domain;  // mesh_vertex filled in
  std::vector<std::vector<VertexId>>
      given;  // mesh paths that are prescribed: along lines, and from pins to the boundary
};

// Everything: outline (or a box around the pins, for a surface with a collar), pins, lines, paths.
// In a target that overlaps itself a pin without a path must have one sheet to lie in: none is
// Infeasible (kContradictoryPins), several are InvalidInput (kBadPins; give a path).
Target full_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context);

// Throws what full_target() throws about pins and lines of a target that overlaps itself, whatever
// its paths cross: these need not be straight, as they are there.
void check_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                  const ExecutionContext& context);

// Self-overlapping polygons: is a closed polygon the boundary of a disk laid out locally
// injectively in the plane, and if so, a triangulation of that disk whose vertices are the
// polygon's corners.
//
// Based on: P. Shor and C. Van Wyk, "Detecting and decomposing self-overlapping curves" (1992), the
// dynamic programme; O. Weber and D. Zorin, "Locally injective parametrization with arbitrary fixed
// boundaries" (2014), whose weakly self-overlapping polygons may wind more than once around single
// corners. Thesis 3.3, phase 1.
//
// Why orientation tests are enough. Let theta_i in (0, 2 pi] be the inner angle at corner i and t
// the turning number, so that sum theta_i = (n - 2 t) pi. Triangles that are all counter-clockwise
// and glue to a disk with this boundary have angles that sum to (n - 2) pi, and at corner i to
// theta_i + 2 pi k_i with k_i >= 0. Hence sum k_i = t - 1:
//   t <  1  no such disk exists (a figure-eight has t = 0, a clockwise polygon t = -1);
//   t == 1  every k_i = 0: the disk is locally injective at its boundary, too;
//   t >  1  t - 1 extra rounds sit at boundary corners ("singular" ones): weakly self-overlapping.
// A spike, where the polygon returns along itself, has theta = 2 pi: it is the tip of a slit cut
// into the disk, which is how a path from the boundary to an inner point chooses between several
// disks with the same boundary.

// On which sheet of a target every pin lies: what a homotopy has to know.

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
// to, or the one that a line leads to from a pin or the boundary. Errors as full_target(), which
// also refuses what meets on one sheet; a line that leaves the disk is Infeasible
// (kContradictoryPins).
SheetTarget sheet_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                         const ExecutionContext& context);

}  // namespace flipfree::matchmaker
