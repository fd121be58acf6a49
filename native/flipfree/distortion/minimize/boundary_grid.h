// The boundary of a chart in the plane: exact test whether the chart overlaps itself, and search
// for near pairs.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::distortion {

struct Boundary {
  std::vector<std::array<VertexId, 2>> edges;  // surface on the left, by half-edge number
  std::vector<VertexId> vertices;              // ascending
  std::vector<std::vector<VertexId>> loops;    // surface on the left
};
Boundary find_boundary(Index vertex_count, const Triangles& faces);

// Boundary edges by the square cells that they pass through; about as many cells as edges.
class BoundaryGrid {
 public:
  BoundaryGrid(const Boundary& boundary, const Points2& uv);

  // Exact: first pair of edges that have a point in common other than a shared vertex; {kInvalid,
  // kInvalid} if there is none.
  std::array<Index, 2> first_conflict(const ExecutionContext& context) const;

  // Edges with a point within `radius` of `point` (and perhaps some further ones), ascending.
  void near(const Vector2& point, double radius, std::vector<Index>& edges) const;

 private:
  static Index clamped(double cells, Index count);
  Index column(double x) const;
  Index row(double y) const;
  template <typename Visit>
  void for_cells(const Vector2& a, const Vector2& b, Visit visit) const;

  const Boundary& boundary_;
  const Points2& uv_;
  Vector2 low_;
  double cell_ = 1;
  Index columns_ = 1;
  Index rows_ = 1;
  std::vector<Index> begin_;  // cell -> range in edges_
  std::vector<Index> edges_;
};

// Exact: the loops that run counter-clockwise, all but the outermost: holes and slits turned inside
// out. Precondition: no conflict.
std::vector<std::size_t> turned_loops(const Boundary& boundary, const Points2& uv);

// Exact: false if the chart is one-to-one. With flip-free triangles it is where no two boundary
// edges meet and no loop is turned; touching counts as meeting.
bool overlaps_itself(const Boundary& boundary, const Points2& uv, const ExecutionContext& context);

}  // namespace flipfree::distortion
