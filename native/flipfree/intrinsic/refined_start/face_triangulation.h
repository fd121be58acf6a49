// Triangulates one face of the input with points on its sides and inside.
//
// No Delaunay triangulation of CGAL's: points on a side are exactly collinear in affine coordinates
// only, circles are round in the plane of the face only, and places there are rounded. In the plane
// a side's points would bulge out of the face by roundings; in affine coordinates other diagonals
// would be taken. One triangulation has to ask both.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::intrinsic {

// Grows from one triangle by insertion. Positivity is exact, in the affine coordinates (weight of
// corner 1, weight of corner 2), in which points on a side are exactly collinear; which diagonal is
// taken follows from the places in the plane of the face.
class FaceTriangulation {
 public:
  struct Point {
    Vector2 affine;
    Vector2 place;
  };
  // Empties it and starts with the face itself, points 0, 1, 2.
  void start(const std::array<Point, 3>& corners);
  // The number of the point; of an earlier one if it is at the same place. Precondition: inside the
  // face or on its sides.
  Index insert(const Point& point);

  Index triangle_count() const { return static_cast<Index>(vertex_.size() / 3); }
  Index vertex(Index corner) const { return vertex_[at(corner)]; }
  // Half-edges and corners are numbered 3 t + k; kInvalid on the sides of the face.
  Index opposite(Index halfedge) const { return opposite_[at(halfedge)]; }
  const Point& point(Index v) const { return points_[at(v)]; }

 private:
  int side_of(Index halfedge, const Vector2& affine) const;
  void link(Index a, Index b);
  void set(Index triangle, Index a, Index b, Index c);
  void split_triangle(Index t, Index v);
  void split_side(Index halfedge, Index v);
  void restore_delaunay();
  bool should_flip(Index halfedge) const;
  void flip(Index halfedge);

  std::vector<Point> points_;
  std::vector<Index> vertex_;    // 3 per triangle
  std::vector<Index> opposite_;  // 3 per triangle
  std::vector<Index> stack_;
  Index last_ = 0;  // triangle where a walk starts
};

}  // namespace flipfree::intrinsic
