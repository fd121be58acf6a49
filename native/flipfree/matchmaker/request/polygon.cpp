#include "flipfree/matchmaker/request/polygon.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// Is the direction from a to b in [0, pi)? Comparing coordinates is exact, subtracting them is not.
bool points_up(const Vector2& a, const Vector2& b) {
  return b.y() > a.y() || (b.y() == a.y() && b.x() > a.x());
}

}  // namespace

int turning_number(const Polygon& polygon) {
  const std::size_t n = polygon.size();
  int turns = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2& previous = polygon[(i + n - 1) % n];
    const Vector2& corner = polygon[i];
    const Vector2& next = polygon[(i + 1) % n];
    const bool up_before = points_up(previous, corner);
    const bool up_after = points_up(corner, next);
    if (up_before == up_after) continue;
    // The direction passes the positive x-axis counter-clockwise exactly when it turns left out of
    // the lower half circle into the upper one; clockwise when it turns right (or back) out of the
    // upper one.
    const int side = numeric::orientation(previous, corner, next);
    if (side > 0 && up_after) ++turns;
    if (side <= 0 && up_before) --turns;
  }
  return turns;
}

bool is_locally_convex(const Polygon& polygon) {
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (numeric::orientation(polygon[i], polygon[(i + 1) % n], polygon[(i + 2) % n]) < 0)
      return false;
  }
  return true;
}

std::optional<std::pair<Index, Index>> first_conflict(const Polygon& polygon) {
  const std::size_t n = polygon.size();
  const auto begin = [&](std::size_t e) -> const Vector2& { return polygon[e]; };
  const auto end = [&](std::size_t e) -> const Vector2& { return polygon[(e + 1) % n]; };
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto low = [&](std::size_t e) { return std::min(begin(e).x(), end(e).x()); };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return low(a) != low(b) ? low(a) < low(b) : a < b;
  });
  std::vector<std::size_t> open;
  for (const std::size_t e : order) {
    std::size_t kept = 0;
    for (const std::size_t f : open) {
      if (std::max(begin(f).x(), end(f).x()) < low(e)) continue;
      open[kept++] = f;
      if (std::max(begin(f).y(), end(f).y()) < std::min(begin(e).y(), end(e).y()) ||
          std::max(begin(e).y(), end(e).y()) < std::min(begin(f).y(), end(f).y())) {
        continue;
      }
      const bool neighbours = (e + 1) % n == f || (f + 1) % n == e;
      // Corners of edges that are not neighbours must differ as well.
      const bool corners_meet = !neighbours && (begin(e) == begin(f) || begin(e) == end(f) ||
                                                end(e) == begin(f) || end(e) == end(f));
      if (corners_meet || numeric::segments_conflict(begin(e), end(e), begin(f), end(f))) {
        return std::pair(static_cast<Index>(std::min(e, f)), static_cast<Index>(std::max(e, f)));
      }
    }
    open.resize(kept);
    open.push_back(e);
  }
  return std::nullopt;
}

int locate_in_polygon(const Polygon& polygon, const Vector2& point) {
  const std::size_t n = polygon.size();
  bool inside = false;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2& a = polygon[i];
    const Vector2& b = polygon[(i + 1) % n];
    if (point == a) return 0;
    if (std::min(a.y(), b.y()) > point.y() || std::max(a.y(), b.y()) < point.y()) continue;
    const int side = numeric::orientation(a, b, point);
    if (side == 0) {
      if (std::min(a.x(), b.x()) <= point.x() && point.x() <= std::max(a.x(), b.x())) return 0;
      continue;
    }
    // Half-open in y, so that a corner on the ray is counted once.
    if ((a.y() <= point.y()) != (b.y() <= point.y()) && (side > 0) == (b.y() > a.y()))
      inside = !inside;
  }
  return inside ? 1 : -1;
}

Vector3 barycentric(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& point) {
  const double area = twice_area(a, b, c);
  const double at_b = twice_area(a, point, c) / area;
  const double at_c = twice_area(a, b, point) / area;
  return {1 - at_b - at_c, at_b, at_c};
}

Points2 rows_of(const Polygon& points) {
  Points2 rows(static_cast<Eigen::Index>(points.size()), 2);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = points[at(i)].transpose();
  return rows;
}

std::vector<double> numbers_of(const Polygon& points) {
  std::vector<double> numbers;
  for (const Vector2& p : points) numbers.insert(numbers.end(), {p.x(), p.y()});
  return numbers;
}

}  // namespace flipfree::matchmaker
