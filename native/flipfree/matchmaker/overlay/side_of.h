// On which side of a line a point lies, where what is next to it counts as on it.
#pragma once

#include <cmath>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {

// What comes nearer to a line than this, in units of the lengths at hand, is taken to lie on it:
// slivers between them would be too thin for doubles, and places that were computed twice agree up
// to rounding only. Whether a map is valid is tested exactly in the end.
constexpr double kOnLine = 1e-10;

// Of the line from a to b: 1 to the left, -1 to the right, 0 next to it.
inline int side_of(const Vector2& a, const Vector2& b, const Vector2& p) {
  const double least = kOnLine * (b - a).norm() * ((p - a).norm() + (p - b).norm());
  return std::abs(twice_area(a, b, p)) <= least ? 0 : numeric::orientation(a, b, p);
}

}  // namespace flipfree::matchmaker
