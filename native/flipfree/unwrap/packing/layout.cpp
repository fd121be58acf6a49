#include "flipfree/unwrap/packing/layout.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/convex_hull_2.h>
#include <CGAL/min_quadrilateral_2.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "flipfree/base/plane.h"

namespace flipfree::unwrap {
namespace {

// Unit direction of a longer side of the smallest rectangle around the points; nothing where all
// are on a line.
std::optional<Vector2> smallest_rectangle_direction(const Points2& points) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_2> input, hull, rectangle;
  for (Eigen::Index i = 0; i < points.rows(); ++i) input.emplace_back(points(i, 0), points(i, 1));
  CGAL::convex_hull_2(input.begin(), input.end(), std::back_inserter(hull));
  if (hull.size() < 3) return std::nullopt;
  CGAL::min_rectangle_2(hull.begin(), hull.end(), std::back_inserter(rectangle));
  const auto side = [&](std::size_t k) {
    return Vector2(rectangle[k + 1].x() - rectangle[k].x(),
                   rectangle[k + 1].y() - rectangle[k].y());
  };
  const Vector2 longer = side(0).norm() >= side(1).norm() ? side(0) : side(1);
  if (!std::isnormal(longer.norm())) return std::nullopt;
  return longer.normalized();
}

}  // namespace

void turn_to_smallest_rectangle(Points2& uv) {
  if (!uv.allFinite()) return;  // which has no hull
  const std::optional<Vector2> x = smallest_rectangle_direction(uv);
  if (!x) return;
  const auto turn = [&](const Vector2& direction) {
    for (Eigen::Index i = 0; i < uv.rows(); ++i) {
      const Vector2 p = uv.row(i);
      uv.row(i) << p.dot(direction), p.y() * direction.x() - p.x() * direction.y();
    }
  };
  turn(*x);
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
