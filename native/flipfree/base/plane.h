// What geometry in the plane is made of. In floating point: what is decided is
// decided by numeric/predicates.h.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/types.h"

namespace flipfree {

inline constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

// |a| |b| times the sine of the angle from a to b: twice the area of their triangle, positive if b
// lies to the left of a.
inline double cross(const Vector2& a, const Vector2& b) { return a.x() * b.y() - a.y() * b.x(); }

inline double twice_area(const Vector2& a, const Vector2& b, const Vector2& c) {
  return cross(b - a, c - a);
}

// Can the 32-bit floats in which UVs are stored hold it (in size, not to the last bit)?
inline bool is_storable(const Vector2& uv) {
  return (uv.array().abs() <= std::numeric_limits<float>::max()).all();  // NaN is not
}

// The angle from a to b, in [-pi, pi].
inline double turn(const Vector2& a, const Vector2& b) { return std::atan2(cross(a, b), a.dot(b)); }

// Four times the area of the triangle with these sides, 0 if they do not close: Heron's formula in
// Kahan's form, by which needles keep their height. Real: double or long double.
template <typename Real>
Real quadruple_area(Real big, Real middle, Real small) {
  if (big < middle) std::swap(big, middle);
  if (middle < small) std::swap(middle, small);
  if (big < middle) std::swap(big, middle);
  const Real square = (big + (middle + small)) * (small - (big - middle)) *
                      (small + (big - middle)) * (big + (middle - small));
  return std::sqrt(std::max(Real(0), square));
}

}  // namespace flipfree
