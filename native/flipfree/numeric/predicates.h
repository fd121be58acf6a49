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

// Products of doubles without an error.

// A number as the sum of two doubles that do not overlap.
struct Pair {
  double high = 0.0;
  double low = 0.0;
};

// x y as a pair (Dekker 1971; Veltkamp splitting). Not by std::fma: some systems' rounds twice.
// Precondition: |x| and |y| are below 2^996, |x y| below 2^1023. The pair is exact unless |x y| is
// below 2^-969 and not 0; its error is then below 2^-1072.
inline Pair two_product(double x, double y) {
  constexpr double kSplitter = 134217729.0;  // 2^27 + 1
  const double high = x * y;
  const double xs = kSplitter * x;
  const double xh = xs - (xs - x);
  const double xl = x - xh;
  const double ys = kSplitter * y;
  const double yh = ys - (ys - y);
  const double yl = y - yh;
  return {high, ((xh * yh - high) + xh * yl + xl * yh) + xl * yl};
}

}  // namespace flipfree::numeric
