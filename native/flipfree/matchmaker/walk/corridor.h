// Ways for a point in the plane past others: which side to pass them on, and how much room there
// is.
//
// Room is found as in motion planning: around a straight leg a box, cut by one half-plane per
// obstacle (Liu, Watterson, Mohta, Sun, Bhattacharya, Taylor, Kumar 2017, "Planning dynamically
// feasible trajectories for quadrotors using safe flight corridors in 3-D complex environments",
// without their ellipsoid).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/request/polygon.h"

namespace flipfree::matchmaker {

struct Obstacles {
  std::vector<Vector2> points;
  Polygon outline;  // simple and counter-clockwise; the way stays inside. Empty: the whole plane
  // Edges of the mesh: no obstacles, but a way that crosses few of them drags little along.
  struct Edge {
    Vector2 a, b;
    double cost;  // of crossing it, in units of length
  };
  std::vector<Edge> edges;
};

// Distance from the segment ab to the nearest obstacle.
double clearance(const Vector2& a, const Vector2& b, const Obstacles& obstacles);

// A convex polygon, counter-clockwise, with the segment ab inside and no obstacle: the box that
// extends `reach` times the segment's length beyond it, without what lies beyond the share `keep`
// of the way to an obstacle. Precondition: clearance(a, b) > 0, a != b.
Polygon corridor_around(const Vector2& a, const Vector2& b, const Obstacles& obstacles,
                        double reach, double keep);

// Corners of a way from `from` to `to`, without the first: straight if that is cheapest, otherwise
// through the gaps between obstacles (edges of their Delaunay triangulation): short, but not
// through the narrowest gaps. Empty if `from` or `to` is an obstacle or outside the outline. Cost:
// O(n log n) for n obstacles and n per leg considered.
std::vector<Vector2> find_way(const Vector2& from, const Vector2& to, const Obstacles& obstacles,
                              const ExecutionContext& context);

}  // namespace flipfree::matchmaker
