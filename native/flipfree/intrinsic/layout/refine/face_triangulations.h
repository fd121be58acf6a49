// Which points of a map's edges are in use, and how each face is triangulated with them: what
// refine_map() works on.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/layout/polygon/face_cells.h"
#include "flipfree/intrinsic/layout/polygon/polygon_triangulation.h"
#include "flipfree/intrinsic/layout/refine/edge_point_map.h"
#include "flipfree/intrinsic/layout/refine/refined_layout.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

class FaceTriangulations {
 public:
  using Triangle = std::array<Index, 3>;  // vertices of the input; vertex count + p is point p

  // No point in use, every face whole. The arguments must outlive this.
  FaceTriangulations(const mesh::Surface& input, const EdgePointMap& map);

  const EdgePointMap& map() const { return map_; }
  Index vertex_count() const { return vertex_count_; }
  std::size_t face_count() const { return slot_.size(); }
  bool uses(std::int64_t p) const { return active_[static_cast<std::size_t>(p)] != 0; }
  void use(std::int64_t p, bool used) { active_[static_cast<std::size_t>(p)] = used ? 1 : 0; }

  // Does any side of the face have points, in use or not?
  bool has_points(FaceId f) const;
  // The face's image as a polygon of its corners and the points in use, in a frame isometric to the
  // surface.
  void build_polygon(FaceId f, std::vector<PolygonVertex>& polygon) const;
  // Points on each side of the face, in use or not, and where those in use and the corners lie: one
  // place per vertex of the polygon.
  std::array<Index, 3> point_counts(FaceId f) const;
  std::vector<SidePlace> places(FaceId f) const;
  // The face's own triangles, to be changed.
  std::vector<Triangle>& triangles(FaceId f);

  // The refined surface and its UVs; `invalid` is left empty. Cost: O(#F + points).
  RefinedLayout write(const ExecutionContext& context) const;

 private:
  void write_points(RefinedLayout& out) const;
  void write_faces(RefinedLayout& out, const ExecutionContext& context) const;

  const mesh::Surface& input_;
  const EdgePointMap& map_;
  Index vertex_count_;
  std::vector<char> active_;  // per point
  std::vector<Index> slot_;   // per face: its triangulation, kInvalid = the face itself
  std::vector<std::vector<Triangle>> triangulations_;
};

}  // namespace flipfree::intrinsic
