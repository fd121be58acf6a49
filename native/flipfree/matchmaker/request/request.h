// What the caller demands of a matched map, and what that comes to for the solver.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/matchmaker/request/devices.h"
#include "flipfree/matchmaker/request/polygon.h"

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

  Devices ablated = 0;  // MatchOptions::ablated

  bool free_boundary() const { return outline.empty(); }
  bool use(Device device) const { return !contains(ablated, device); }
};

// May a map with a free boundary overlap itself?
enum class SelfOverlaps { kRefused, kAllowed };

}  // namespace flipfree::matchmaker
