// Angles of a triangle from its lengths, in half tangents: with x[k] = s - 2 length[k] relative to
// the perimeter s and radius = sqrt(x[0] x[1] x[2]), tan(angle opposite k / 2) = radius / x[k].
// Small relative errors, whatever the shape; only the x suffer from cancellation.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {

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
