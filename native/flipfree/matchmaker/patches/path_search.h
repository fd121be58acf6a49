// The shortest path between two vertices over a surface that other paths have cut up (Dijkstra),
// along edges and across them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/curve_overlay.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// A step of a path: to a vertex, or across an edge of the surface, which is split there.
struct PathStep {
  VertexId vertex = kInvalid;
  std::array<VertexId, 2> edge = {kInvalid, kInvalid};
};

// An end of a path, and the faces around it through which the path may leave or arrive.
struct PathEnd {
  VertexId vertex = kInvalid;
  std::vector<FaceId> sector;
};

class PathSearch {
 public:
  // All outlive this and may change between searches. `overlay`: lays the paths over the surface.
  // taken[v]: no path may pass through v.
  PathSearch(const mesh::RefinedSurface& surface, const mesh::CurveOverlay& overlay,
             const std::vector<bool>& taken);

  // Steps after `from`, the last of them `to`. Paths cross free edges (unmarked, inner) and pass
  // through free vertices. Throws InternalError if there is none. Cost: O(k log k) for k faces that
  // are visited.
  std::vector<PathStep> run(const PathEnd& from, const PathEnd& to,
                            const ExecutionContext& context);
  // Of the path that was found last.
  double length() const { return length_; }

 private:
  const Vector3& place(HalfedgeId corner) const;
  Vector3 crossing(HalfedgeId h) const;
  double cost(HalfedgeId h, const Vector3& here) const;
  double mean_length() const;
  // Nodes: vertex v, or, entering the face of h, the middle of the edge of h: a path that has
  // crossed an edge goes on through the face beyond it. Distances are kept by stamps, so that a
  // search costs only what it visits.
  std::size_t vertex_node(VertexId v) const { return static_cast<std::size_t>(v); }
  std::size_t edge_node(HalfedgeId h) const {
    return static_cast<std::size_t>(mesh_.vertex_count() + h);
  }
  std::vector<PathStep> read_path(std::size_t start, std::size_t goal) const;

  const mesh::RefinedSurface& surface_;
  const mesh::EditableTriangulation& mesh_;
  const mesh::CurveOverlay& overlay_;
  const std::vector<bool>& taken_;
  double crossing_cost_;
  double length_ = 0;
  std::vector<double> distance_;
  std::vector<std::size_t> previous_;
  std::vector<std::uint32_t> stamp_;
  std::uint32_t now_ = 0;
};

}  // namespace flipfree::matchmaker
