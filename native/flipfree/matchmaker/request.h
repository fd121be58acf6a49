// What the caller demands of a matched map, and what that comes to for the solver.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// A closed polygon: its corners in order, the last one joined to the first, the surface on its
// left. What is asked of it is decided exactly.
using Polygon = std::vector<Vector2>;

// Does it nowhere turn right? Convex polygons are so, and some that wind more than once. Cost:
// O(n).
bool is_locally_convex(const Polygon& polygon);

// Two edges (numbered by their first corner) that meet where they must not, if there are any: the
// polygon is simple exactly if there are none. Cost: O(n + pairs of edges near each other).
std::optional<std::pair<Index, Index>> first_conflict(const Polygon& polygon);

// Where a point lies: 1 strictly inside, 0 on the polygon, -1 outside. Exact. Precondition: the
// polygon is simple. Cost: O(n). Defined in target_domain.cpp, with what else is CGAL's.
int locate_in_polygon(const Polygon& polygon, const Vector2& point);

// The weights of a point by the corners of a triangle that has an area. They sum to one.
Vector3 barycentric(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& point);

// One point, one triangle per row; and back.
Points2 rows_of(const Polygon& points);
Triangles rows_of(const std::vector<mesh::EditableTriangulation::Triangle>& triangles);
Polygon points_of(const Points2& rows);
// x0, y0, x1, y1, ..., as witnesses hold points.
std::vector<double> numbers_of(const Polygon& points);

// How far along a polyline each of its points lies.
template <typename Point>
std::vector<double> lengths_along(const std::vector<Point>& points) {
  std::vector<double> along = {0.0};
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
    along.push_back(along.back() + (points[i + 1] - points[i]).norm());
  return along;
}
// The lengths of a closed polygon's sides, from its first corner on.
template <typename Point>
std::vector<double> side_lengths(const std::vector<Point>& corners) {
  std::vector<double> lengths;
  for (std::size_t i = 0; i < corners.size(); ++i)
    lengths.push_back((corners[(i + 1) % corners.size()] - corners[i]).norm());
  return lengths;
}
// The first of vertices one after another.
std::vector<double> lengths_along(const mesh::RefinedSurface& surface,
                                  const std::vector<VertexId>& chain);

// How a match is made.

enum class MatchEngine {
  kAuto,        // first try, then MatchMaker++
  kFirstTry,    // for tests and papers: NotConverged if the first try fails
  kOutline,     // for tests and papers: straight to the homotopy of outlines (move_outline.cpp)
  kArms,        // for tests and papers: straight to an arm for every pin (arms.cpp)
  kMatchmaker,  // for tests and papers: straight to MatchMaker++
};

struct MatchOptions {
  bool optimise = true;  // lower the distortion with all constraints held
  bool bijective =
      false;  // with a free boundary: the map must be one-to-one as a whole, not only locally
  int max_iterations = 200;
  MatchEngine engine = MatchEngine::kAuto;
  // Of the clock; 0: no limit. The ways share them. Once a map meets all
  // constraints, it is returned in the end, however little time there was to make it better.
  double max_seconds = 0;
};

struct PinnedVertex {
  VertexId vertex = kInvalid;
  Vector2 uv = Vector2::Zero();
};

// A chain of mesh edges that is laid along a polyline. With as many points as vertices they
// correspond one to one; otherwise ends to ends, inner points to the nearest vertices by length
// (the chain is split where it has too few), and the remaining vertices are spread in between.
struct PinnedLine {
  std::vector<VertexId> vertices;
  Polygon polyline;
};

struct MatchRequest {
  std::vector<PinnedVertex> points;
  std::vector<PinnedLine> lines;
  // The whole boundary, or nothing: then it is free. Without a loop, boundary_uv follows
  // boundary_loops().
  std::vector<VertexId> boundary_loop;
  Polygon boundary_uv;
  // Boundary vertices whose targets are where they begin only: once the map is there, the descent
  // may move them.
  std::vector<VertexId> movable;
  // For targets that overlap themselves: from a pinned vertex along mesh edges to the boundary.
  std::vector<std::vector<VertexId>> paths;
};

struct Constraints {
  std::vector<PinnedVertex>
      pins;  // inner pins and those of lines, ascending by vertex; without a prescribed boundary's
  std::vector<std::pair<VertexId, VertexId>> edges;  // mesh edges laid along lines
  std::vector<VertexId> movable;                     // boundary vertices, ascending
  Polygon outline;         // by place in RefinedSurface::boundary; empty: free boundary
  int turning_number = 1;  // of the outline
  bool simple_outline = true;
  bool one_to_one = false;                   // free boundary: the map may not overlap itself
  std::vector<std::vector<VertexId>> paths;  // each from a pin to the boundary

  bool free_boundary() const { return outline.empty(); }
};

// May a map with a free boundary overlap itself?
enum class SelfOverlaps { kRefused, kAllowed };

// What all ways to a map are given, and what they return.
struct Problem {
  const mesh::RefinedSurface& surface;  // with the vertices that the constraints need
  const Constraints& constraints;
  const MatchOptions& options;

  // A target that overlaps itself: which disk, and on which sheet a pin lies, is for the homotopy
  // to say.
  bool overlapping() const { return !constraints.free_boundary() && !constraints.simple_outline; }
};

struct Solution {
  mesh::RefinedMap map;
  std::string engine;  // what really made it
};

// How the ways to a map share the time that a call has (MatchOptions::max_seconds).
//
//   |<------------------------------ max_seconds ------------------------------>|
//   | one way, its share | the next, its share of the rest | ... | the last way  |
//                              a way arrived: taking refinement back, optimising, storing
//
// A way that runs out of its share is given up for the next. Once there is a map that meets all
// constraints, nothing is given up any more: what is over ends, with the best map so far.

// Of the time that is left: for a way that others follow, and for each of the steps that follow a
// way that arrived, but the last.
constexpr double kShareOfWay = 0.5;
constexpr double kShareOfStep = 0.4;

// Infeasible (kContradictoryPins): demands on these vertices that no map meets, with a proof.
[[noreturn]] void throw_contradiction(const std::string& message, Witness witness,
                                      std::vector<VertexId> vertices);

// What the caller demands, read and checked for contradictions that can be named, each with a proof
// that others can check (docs/errors.md).

// Splits chain edges of `surface` where lines have more points than vertices. Throws InvalidInput
// (kBadPins, kIndexOutOfRange, kBadBoundary, kNotFinite, kNotAnEdge) for malformed requests,
// Infeasible (kContradictoryPins, kNotSelfOverlapping) for demands that no map can meet: two
// vertices at one point, crossing lines, a pin outside the outline, an outline that runs clockwise
// or winds wrongly. Where the boundary is free and the map may overlap itself, pins and lines that
// meet are no contradiction, but nothing that is looked for: NotConverged.
Constraints read_constraints(mesh::RefinedSurface& surface, const MatchRequest& request,
                             SelfOverlaps overlaps = SelfOverlaps::kRefused);

// Vertices that constraints hold, ascending.
std::vector<VertexId> held_vertices(const mesh::RefinedSurface& surface,
                                    const Constraints& constraints);
// The constraints without pins, lines and paths.
Constraints outline_alone(const Constraints& constraints);

}  // namespace flipfree::matchmaker
