// A target outline as the last frame of a homotopy: a family of immersed polygons that begins with
// a convex one.
//
// A triangulation of the outline by its corners alone has no inner vertex, so its triangles form a
// tree, glued edge to edge. Any edge lengths that satisfy the triangle inequalities lay it out, and
// positive triangles are all that an immersed disk without inner vertices asks for. Lengths that
// satisfy the inequalities form a convex set: blending those of the same triangulation on a circle
// with those of the target,
//
//   l(t) = (1 - t) l_circle + t l_target,    0 <= t <= 1,
//
// gives an immersed disk for every t. The disk a target bounds (several may share one outline) is
// that of its triangulation, and inner points ride on their triangle.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "flipfree/matchmaker/target/sheet_target.h"

namespace flipfree::matchmaker {

class OutlineHomotopy {
 public:
  // Precondition: the domain has no inner vertices. Cost: O(n).
  OutlineHomotopy(TargetDomain domain, const std::vector<SheetPin>& pins);

  const TargetDomain& domain() const { return domain_; }
  const std::vector<SheetPin>& pins() const { return pins_; }

  // Corners of frame t, per domain vertex. Frame 1 is the target bit for bit, frame 0 a convex
  // polygon with its corners on a circle. Frames change continuously. Cost: O(n).
  std::vector<Vector2> corners(double t) const;
  // Where frame t wants the mesh vertices: outline, then pins.
  std::vector<std::pair<VertexId, Vector2>> places(double t,
                                                   const std::vector<Vector2>& corners) const;

 private:
  double length(HalfedgeId h, double t) const;

  TargetDomain domain_;
  std::vector<SheetPin> pins_;
  std::vector<std::array<double, 3>> weight_;  // per pin
  std::vector<Vector2> circle_;                // per domain vertex
  FaceId root_ = 0;                            // in the middle of the tree; it stays in place
  std::vector<HalfedgeId> glue_;  // per other face, parents first, the half-edge to its parent
};

}  // namespace flipfree::matchmaker
