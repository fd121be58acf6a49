// Exact geometric predicates. The sign that comes back is the true sign for the given
// floating-point values, whatever their scale; nothing here has a tolerance. Filters make the
// common case a handful of flops.
#pragma once

#include "flipfree/base/types.h"

namespace flipfree::numeric {

// +1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if collinear or a coordinate is not
// finite.
int orientation(const double* a, const double* b, const double* c);
inline int orientation(const Vector2& a, const Vector2& b, const Vector2& c) {
  return orientation(a.data(), b.data(), c.data());
}
// The same for values stored as 32-bit floats (each is a double exactly).
int orientation(const float* a, const float* b, const float* c);

// +1 if d lies inside the circle through a, b, c (counter-clockwise), -1 outside, 0 on it or if a
// coordinate is not finite.
int in_circle(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& d);

// Do the closed segments ab and cd meet in a point that is not an end point of both? Shared end
// points alone do not count; an end point inside the other segment, a crossing and a collinear
// overlap do.
bool segments_conflict(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& d);

}  // namespace flipfree::numeric
