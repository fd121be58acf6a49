#include "flipfree/unwrap/packing/layout.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/convex_hull_2.h>
#include <CGAL/min_quadrilateral_2.h>

#include <cmath>
#include <iterator>
#include <vector>

namespace flipfree::unwrap {

Vector2 turn_to_smallest_rectangle(const Points2& points) {
  const Vector2 none(1.0, 0.0);
  if (!points.allFinite()) return none;  // which have no hull
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_2> input, hull, rectangle;
  for (Eigen::Index i = 0; i < points.rows(); ++i) input.emplace_back(points(i, 0), points(i, 1));
  CGAL::convex_hull_2(input.begin(), input.end(), std::back_inserter(hull));
  if (hull.size() < 3) return none;
  CGAL::min_rectangle_2(hull.begin(), hull.end(), std::back_inserter(rectangle));
  const auto side = [&](std::size_t k) {
    return Vector2(rectangle[k + 1].x() - rectangle[k].x(),
                   rectangle[k + 1].y() - rectangle[k].y());
  };
  const Vector2 longer = side(0).norm() >= side(1).norm() ? side(0) : side(1);
  return std::isnormal(longer.norm()) ? Vector2(longer.x(), -longer.y()).normalized() : none;
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
  return uv(faces.reshaped<Eigen::RowMajor>(), Eigen::all);
}

}  // namespace flipfree::unwrap
