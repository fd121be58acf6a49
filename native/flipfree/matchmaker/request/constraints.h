// What the caller demands of a matched map, checked for contradictions that can be named.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/matchmaker/request/polygon.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

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

// Splits chain edges of `surface` where lines have more points than vertices. Throws InvalidInput
// (kBadPins, kIndexOutOfRange, kBadBoundary, kNotFinite, kNotAnEdge) for malformed requests,
// Infeasible (kContradictoryPins, kNotSelfOverlapping) for demands that no map can meet: two
// vertices at one point, crossing lines, a pin outside the outline, an outline that runs clockwise
// or winds wrongly. Where the boundary is free and the map may overlap itself, pins and lines that
// meet are no contradiction, but nothing that is looked for: NotConverged.
enum class SelfOverlaps { kRefused, kAllowed };
Constraints read_constraints(mesh::RefinedSurface& surface, const MatchRequest& request,
                             SelfOverlaps overlaps = SelfOverlaps::kRefused);

}  // namespace flipfree::matchmaker
