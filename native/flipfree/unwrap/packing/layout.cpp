#include "flipfree/unwrap/packing/layout.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/convex_hull_2.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "flipfree/base/plane.h"

namespace flipfree::unwrap {
namespace {

std::vector<Vector2> convex_hull(const Points2& points) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_2> input;
  input.reserve(at(points.rows()));
  for (Eigen::Index i = 0; i < points.rows(); ++i) input.emplace_back(points(i, 0), points(i, 1));
  std::vector<Kernel::Point_2> hull;
  CGAL::convex_hull_2(input.begin(), input.end(), std::back_inserter(hull));
  std::vector<Vector2> corners;
  corners.reserve(hull.size());
  for (const auto& p : hull) corners.emplace_back(p.x(), p.y());
  return corners;
}

// Unit direction of the side on which the smallest rectangle around the convex polygon stands. The
// supporting corners advance monotonically with the side, so the whole turn is linear.
Vector2 smallest_rectangle_direction(const std::vector<Vector2>& hull) {
  const std::size_t n = hull.size();
  const auto corner = [&](std::size_t i) { return hull[i % n]; };
  std::size_t right = 1;
  std::size_t top = 1;
  std::size_t left = 1;
  double best_area = std::numeric_limits<double>::infinity();
  Vector2 best(1.0, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2 side = corner(i + 1) - corner(i);
    const double length = side.norm();
    if (!(length > 0.0)) continue;
    const Vector2 x = side / length;
    const Vector2 y(-x.y(), x.x());
    // At most one turn each: a guard against rounding on nearly equal corners.
    right = std::max(right, i);
    for (std::size_t k = 0; k < n && (corner(right + 1) - corner(right)).dot(x) > 0.0; ++k) ++right;
    top = std::max(top, right);
    for (std::size_t k = 0; k < n && (corner(top + 1) - corner(top)).dot(y) > 0.0; ++k) ++top;
    left = std::max(left, top);
    for (std::size_t k = 0; k < n && (corner(left + 1) - corner(left)).dot(x) < 0.0; ++k) ++left;
    const double area = (corner(right) - corner(left)).dot(x) * (corner(top) - corner(i)).dot(y);
    if (area < best_area) {
      best_area = area;
      best = x;
    }
  }
  return best;
}

}  // namespace

void turn_to_smallest_rectangle(Points2& uv) {
  if (!uv.allFinite()) return;  // which has no hull
  const std::vector<Vector2> hull = convex_hull(uv);
  if (hull.size() < 3) return;
  const Vector2 x = smallest_rectangle_direction(hull);
  const auto turn = [&](const Vector2& direction) {
    for (Eigen::Index i = 0; i < uv.rows(); ++i) {
      const Vector2 p = uv.row(i);
      uv.row(i) << p.dot(direction), p.y() * direction.x() - p.x() * direction.y();
    }
  };
  turn(x);
  const Vector2 extent = (uv.colwise().maxCoeff() - uv.colwise().minCoeff()).transpose();
  if (extent.y() > extent.x()) turn(Vector2(0.0, 1.0));
  uv.rowwise() -= uv.colwise().minCoeff().eval();
}

Points2 mirror_image(const Points2& uv) { return uv * Eigen::DiagonalMatrix<double, 2>(-1.0, 1.0); }

Points2 below_each_other(const std::vector<Points2>& parts) {
  Eigen::Index rows = 0;
  for (const Points2& part : parts) rows += part.rows();
  Points2 all(rows, 2);
  rows = 0;
  for (const Points2& part : parts) {
    all.middleRows(rows, part.rows()) = part;
    rows += part.rows();
  }
  return all;
}

Points2 by_corner(const Triangles& faces, const Points2& uv) {
  Points2 corners(faces.size(), 2);
  for (Eigen::Index c = 0; c < corners.rows(); ++c) corners.row(c) = uv.row(faces.data()[c]);
  return corners;
}

}  // namespace flipfree::unwrap
