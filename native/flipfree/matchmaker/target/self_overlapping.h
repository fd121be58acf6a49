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
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/request/polygon.h"

namespace flipfree::matchmaker {

struct SelfOverlap {
  bool exists = false;
  int turning_number = 0;
  Triangles
      triangles;  // (n - 2) x 3 corners of the polygon, counter-clockwise; empty if none exists
  std::vector<Index>
      singular_corners;  // corners with more than 2 pi inside, only if the turning number exceeds 1
};

// Preconditions: at least three corners, all finite, consecutive ones different. Which of several
// disks is found is deterministic but not specified. Cost: O(n^3) orientation tests at worst, in
// practice O(n^3 / 64) bit operations.
SelfOverlap find_self_overlap(const Polygon& polygon, const ExecutionContext& context);

}  // namespace flipfree::matchmaker
