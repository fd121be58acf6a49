// The Delaunay criterion of an edge (thesis 4.4) on lengths: a filter in double, and the test in
// full. c is the edge, a and b the other sides of one of its triangles, a2 and b2 those of the
// other one; no triangle inequality is needed (Penner coordinates). Violations within rounding are
// none, so that stably co-circular edges are not flipped.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {

// Bound of the rounding errors of delaunay_sign, counted in half-ulps of the sum of absolute
// values. The lengths themselves may have been rounded to double, 1 each: a length over c 4 (its
// own, that of c, the inverse, the product), its square 9, left and right 10, minus one 11; a
// product of two sides 9; their product 21, the sum 22 (14 if the lengths are exact). The rest and
// the rounding up of kHalfUlp cover terms of second order and the roundings of the bound. The test
// in full needs 6.
inline constexpr double kDelaunayRoundings = 24.0;
inline constexpr double kHalfUlp = 1.2e-16;  // 2^-53 = 1.11e-16, rounded up

// Sign of the Delaunay criterion (4.4) times the product of the four outer lengths: -1 violated,
// +1 satisfied, 0 within rounding. Lengths are taken relative to the edge, so only their ratios
// must be representable.
inline int delaunay_sign(double c, double a, double b, double a2, double b2) {
  const double inverse = 1.0 / c;
  a *= inverse;
  b *= inverse;
  a2 *= inverse;
  b2 *= inverse;
  const double ab = a * b;
  const double ab2 = a2 * b2;
  const double left = a * a + b * b;
  const double right = a2 * a2 + b2 * b2;
  const double sum = (left - 1.0) * ab2 + (right - 1.0) * ab;
  const double bound = kDelaunayRoundings * kHalfUlp * ((left + 1.0) * ab2 + (right + 1.0) * ab);
  if (sum > bound) return 1;
  if (sum < -bound) return -1;
  return 0;
}

// The same in the scalar type of a run with `bits` mantissa bits: violated beyond rounding?
template <typename T>
bool violates_delaunay_in_full(const T& c, const T& a, const T& b, const T& a2, const T& b2,
                               int bits) {
  const T cc = c * c;
  const T left = a * a + b * b;
  const T right = a2 * a2 + b2 * b2;
  const T ab = a * b;
  const T ab2 = a2 * b2;
  const T sum = (left - cc) * ab2 + (right - cc) * ab;
  const T size = (left + cc) * ab2 + (right + cc) * ab;
  const T rounding = numeric::ScalarTraits<T>::power_of_two(-bits, bits);
  return sum < T(-kDelaunayRoundings) * rounding * size;
}

// Angles of a triangle from its lengths, in half tangents: with x[k] = s - 2 length[k] relative to
// the perimeter s and radius = sqrt(x[0] x[1] x[2]), tan(angle opposite k / 2) = radius / x[k].
// Small relative errors, whatever the shape; only the x suffer from cancellation.

struct TriangleShape {
  double x[3];
  double radius = 0.0;

  double half_tangent(int k) const { return radius / x[k]; }
};

// Errors of the x from lengths rounded to double, three roundings each of at most half of s.
inline constexpr double kRoundedLengthsError = 1e-15;

// The x from lengths in double, which may break the triangle inequality.
inline void perimeter_differences(double a, double b, double c, double x[3]) {
  const double inverse = 1.0 / (a + b + c);
  x[0] = ((b - a) + c) * inverse;
  x[1] = ((c - b) + a) * inverse;
  x[2] = ((a - c) + b) * inverse;
}

// Are x from rounded lengths good enough for angles with errors of at most `accuracy`?
inline bool rounded_lengths_serve(const double x[3], double accuracy) {
  return std::min({x[0], x[1], x[2]}) * accuracy > kRoundedLengthsError;
}

// From lengths with `bits` mantissa bits. Below rounding a length difference is not known; the
// triangle is then read as barely valid.
template <typename T>
TriangleShape shape_in_full(const T& a, const T& b, const T& c, int bits) {
  const double least = std::max(std::ldexp(1.0, -bits), std::numeric_limits<double>::min());
  TriangleShape shape;
  if constexpr (numeric::ScalarTraits<T>::kIsDouble) {
    perimeter_differences(a, b, c, shape.x);
    for (double& x : shape.x) x = std::max(x, least);
    shape.radius = std::sqrt(shape.x[0] * shape.x[1] * shape.x[2]);
  } else {
    const T s = a + b + c;
    shape.x[0] = numeric::ratio(b - a + c, s);
    shape.x[1] = numeric::ratio(c - b + a, s);
    shape.x[2] = numeric::ratio(a - c + b, s);
    for (double& x : shape.x) x = std::max(x, least);
    // One by one: the product may underflow.
    shape.radius = std::sqrt(shape.x[0]) * std::sqrt(shape.x[1]) * std::sqrt(shape.x[2]);
  }
  return shape;
}

// tan^2 of half the angle opposite a, in the precision of the lengths.
template <typename T>
T half_tangent_square(const T& a, const T& b, const T& c) {
  return ((c - b + a) / (a + b + c)) * ((a - c + b) / (b - a + c));
}

}  // namespace flipfree::intrinsic
