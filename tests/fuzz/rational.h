// The plane in rational numbers: a judge of its own for everything that the library decides with
// floating-point filters. Slow, for tiny cases. Coordinates must be finite.
#pragma once

#include <array>
#include <boost/multiprecision/gmp.hpp>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::fuzz {

using Rational = boost::multiprecision::mpq_rational;

struct Point {
  Rational x, y;
  bool operator==(const Point&) const = default;
};
inline Point exact(const Vector2& p) { return {Rational(p.x()), Rational(p.y())}; }

// Twice the signed area.
Rational area(const Point& a, const Point& b, const Point& c);
inline int side(const Point& a, const Point& b, const Point& c) { return area(a, b, c).sign(); }

using Corners = std::array<Point, 3>;
// Do the interiors of two triangles (of any orientation, degenerate ones have none) meet? One is
// clipped by the sides of the other; what is left has an area or not.
bool share_area(const Corners& p, const Corners& q);

// What two closed segments have in common.
struct Meeting {
  bool meet = false;
  bool along = false;  // in more than one point
  Point at;            // if in one point
};
Meeting meeting(const Point& a, const Point& b, const Point& c, const Point& d);

}  // namespace flipfree::fuzz
