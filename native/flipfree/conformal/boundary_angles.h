// Target angles for usual wishes: flat inside except at given cones, and a boundary that is free,
// straight or round.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::conformal {

enum class BoundaryGoal {
  kFree,      // u = 0 on the boundary: the least area distortion; angles follow from the surface
  kStraight,  // angle pi everywhere, except at the corners, which share what Gauss-Bonnet leaves
              // evenly
  kCircle     // every loop has constant geodesic curvature in the new metric
};

struct BoundaryAnglesOptions {
  BoundaryGoal boundary = BoundaryGoal::kFree;
  std::vector<std::pair<VertexId, double>>
      cones;                      // interior vertices and their total angle; all others 2 pi
  std::vector<VertexId> corners;  // for kStraight
  double max_seconds = 0.0;       // 0 = never
};

// #V target angles that satisfy Gauss-Bonnet to rounding, as conformal() takes them. Closed
// surfaces: the cones alone. Errors: InvalidInput (surface; cones or corners that are out of range,
// on the wrong side of the boundary, or not positive), Infeasible/kGaussBonnet (names the
// remainder), NotConverged (kTimeLimit: not in max_seconds), Cancelled.
std::vector<double> boundary_angles(const mesh::Surface& surface,
                                    const BoundaryAnglesOptions& options,
                                    ExecutionContext& context);

// Moves the angles by a common rounding-sized amount so that they add up for this surface; throws
// Infeasible/kGaussBonnet if more than `tolerance` is missing altogether.
void close_gauss_bonnet(std::vector<double>& angles, const std::vector<bool>& on_boundary,
                        Index euler, double tolerance);

// The same for angles that were measured: NotConverged, since no demand of the caller is at fault.
void close_measured_angles(std::vector<double>& angles, const std::vector<bool>& on_boundary,
                           Index euler, double tolerance);

}  // namespace flipfree::conformal
