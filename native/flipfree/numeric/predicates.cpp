#include "flipfree/numeric/predicates.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace flipfree::numeric {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

bool finite(const double* p) { return std::isfinite(p[0]) && std::isfinite(p[1]); }

Kernel::Point_2 point(const Vector2& p) { return {p.x(), p.y()}; }

// p is known to lie on the line ab: is it within the closed box of ab?
bool within_box(const Vector2& a, const Vector2& b, const Vector2& p) {
  return std::min(a.x(), b.x()) <= p.x() && p.x() <= std::max(a.x(), b.x()) &&
         std::min(a.y(), b.y()) <= p.y() && p.y() <= std::max(a.y(), b.y());
}

}  // namespace

int orientation(const double* a, const double* b, const double* c) {
  // Shewchuk's semi-static filter (1997): if the two products' difference exceeds the rounding
  // error that they can carry, its sign is right. The lower bound keeps underflow out of the
  // argument.
  const double left = (a[0] - c[0]) * (b[1] - c[1]);
  const double right = (a[1] - c[1]) * (b[0] - c[0]);
  const double determinant = left - right;
  constexpr double kErrorFactor = (3.0 + 16.0 * 0x1p-53) * 0x1p-53;
  const double bound = kErrorFactor * (std::abs(left) + std::abs(right));
  if (std::abs(determinant) > bound && bound > 1e-280) return determinant > 0 ? 1 : -1;
  if (!finite(a) || !finite(b) || !finite(c)) return 0;  // what CGAL knows no answer to
  return static_cast<int>(CGAL::orientation(
      Kernel::Point_2(a[0], a[1]), Kernel::Point_2(b[0], b[1]), Kernel::Point_2(c[0], c[1])));
}

int orientation(const float* a, const float* b, const float* c) {
  const double da[2] = {a[0], a[1]};
  const double db[2] = {b[0], b[1]};
  const double dc[2] = {c[0], c[1]};
  return orientation(da, db, dc);
}

int in_circle(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& d) {
  if (!a.allFinite() || !b.allFinite() || !c.allFinite() || !d.allFinite()) return 0;
  return static_cast<int>(CGAL::side_of_oriented_circle(point(a), point(b), point(c), point(d)));
}

bool segments_conflict(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& d) {
  const int c_side = orientation(a, b, c);
  const int d_side = orientation(a, b, d);
  const int a_side = orientation(c, d, a);
  const int b_side = orientation(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) return true;
  const auto touches = [](const Vector2& p, const Vector2& q, const Vector2& r, int side) {
    return side == 0 && r != p && r != q && within_box(p, q, r);
  };
  if (touches(a, b, c, c_side) || touches(a, b, d, d_side) || touches(c, d, a, a_side) ||
      touches(c, d, b, b_side)) {
    return true;
  }
  // Equal segments: both end points shared, the interiors coincide.
  return (a == c && b == d) || (a == d && b == c);
}

}  // namespace flipfree::numeric
