// Turning and moving charts in UV space.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

// Turns the map to the smallest rectangle that bounds it (rotating calipers on the convex hull),
// wider than high, with its lower left corner at the origin.
void turn_to_smallest_rectangle(Points2& uv);

// The similarity (rotation, uniform scale, translation; no reflection) that carries the points
// `from` to `to` best in the least-squares sense: w = a z + b over complex numbers. Identity scale
// if the points coincide.
struct Similarity {
  Vector2 linear = Vector2(1.0, 0.0);  // a = linear.x + i linear.y
  Vector2 translation = Vector2::Zero();
  Vector2 operator()(const Vector2& p) const {
    return {linear.x() * p.x() - linear.y() * p.y() + translation.x(),
            linear.y() * p.x() + linear.x() * p.y() + translation.y()};
  }
};
Similarity fit_similarity(const Points2& from, const Points2& to);
// The best of those that scale by so much.
Similarity fit_motion(const Points2& from, const Points2& to, double scale = 1.0);

// With u negated.
Points2 mirror_image(const Points2& uv);

// Every point carried.
Points2 moved(const Similarity& similarity, const Points2& uv);

// The rows of all parts.
Points2 below_each_other(const std::vector<Points2>& parts);

template <typename Rows>
Eigen::AlignedBox2d bounds_of(const Eigen::MatrixBase<Rows>& uv) {
  return {uv.colwise().minCoeff().transpose(), uv.colwise().maxCoeff().transpose()};
}

// The map (#V x 2) corner by corner, 3 #F x 2.
Points2 by_corner(const Triangles& faces, const Points2& uv);

}  // namespace flipfree::unwrap
