// Intrinsic Delaunay refinement: which flat points to add to a surface so that the intrinsic
// Delaunay triangulation of all its vertices has no small angles (the cure of thesis 4.6.4).
//
// Chew 1993 and Ruppert 1995 on a polyhedral surface, after Sharp, Soliman, Crane 2019,
// "Navigating intrinsic triangulations": circumcentres of bad triangles are added, largest first,
// and midpoints of boundary edges whose diametral circle holds a vertex. An intrinsic
// triangulation with signposts (the direction of every edge at its origin) follows the insertions;
// it finds every new point on the input by a straight line from the nearest vertex. It is computed
// in double and thrown away afterwards: what counts are the places on the input, and any places
// give a valid refined surface (split_surface.h).
//
// A point closer to an edge of the input than kSnap of its distance to the vertices is put on it,
// so that no face of the refined surface is thinner than it must be. Triangles at a vertex with a
// total angle below 60 degrees (30 degrees at each of two edges) are left as they are: no
// refinement can help there.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/refined_start/flat_surface.h"

namespace flipfree::intrinsic {

struct RefinementOptions {
  // Triangles with a smaller angle are bad (radians). Above 20.7 degrees on surfaces with boundary
  // and 30 on closed ones, termination is no theorem, and the number of points is what ends it.
  double least_angle = 0.35;
  Index max_added = 1'000'000;
};

struct RefinementPoints {
  std::vector<AddedPoint> points;  // in the order of insertion
  double smallest_angle = 0.0;     // of the input's intrinsic Delaunay triangulation (away from
                                   // needle vertices), radians
  bool complete = false;           // no bad triangle is left
};

// Deterministic. Cost: O(#F + points) flips and steps, each O(1) on ordinary surfaces.
RefinementPoints find_refinement_points(const FlatSurface& surface,
                                        const RefinementOptions& options,
                                        const ExecutionContext& context);

}  // namespace flipfree::intrinsic
