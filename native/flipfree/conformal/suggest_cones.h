// Suggest Cones: where to put the curvature so that a conformal map distorts scale no more than
// asked.
//
// Greedy, as Springborn, Schröder, Pinkall 2008 (section 6) and Ben-Chen, Gotsman, Bunin 2008: with
// u = 0 at the cones and flat elsewhere the curvature of the cones follows from the surface; the
// vertex with the most extreme u is the next cone. Placement uses the linear problem (the first
// Newton step), for which every new cone costs one solve with one factorization; then the true
// metric is computed, and cones are added at its extremes until the bound holds.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::conformal {

struct SuggestConesOptions {
  // Largest allowed ratio between the largest and the smallest scale (length) factor over all
  // vertices; > 1.
  double bound = 4.0;
  Index max_cones = 200;
  // Round cone curvatures to multiples of this (radians), e.g. pi / 2 for seamless maps; 0 = as
  // they are. Rounded cones are searched for until the bound holds; whether it
  // does, the result says.
  double quantum = 0.0;
  // No suggested cone is sharper than this total angle.
  double least_angle = 0.5235987755982988;  // pi / 6
  // 0 = never. When they are over the best cones whose metric was measured are returned.
  double max_seconds = 0.0;
  // The same, but where there are no such cones yet the search goes on until there are.
  double enough_seconds = 0.0;
};

struct SuggestedCones {
  std::vector<double>
      target_angles;  // #V, ready for conformal(): Gauss-Bonnet holds, boundary free (u = 0)
  std::vector<VertexId> cones;  // in the order in which they were placed
  double scale_ratio = 0.0;     // measured on the metric of target_angles
  bool bound_holds = false;     // scale_ratio <= bound
};

// Errors: InvalidInput (surface, options), NotConverged when max_cones, or the time
// (kTimeLimit), do not suffice even for positive angles, Cancelled. Cost: a factorization, one
// solve per cone, a few conformal metrics.
SuggestedCones suggest_cones(const mesh::Surface& surface, const SuggestConesOptions& options,
                             ExecutionContext& context);

}  // namespace flipfree::conformal
