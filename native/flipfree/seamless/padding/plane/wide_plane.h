// Vectors of the plane in numbers that hold what a conformal metric spans: hundreds of orders of
// magnitude between neighbours, and differences of their places.
#pragma once

#include "flipfree/base/types.h"
#include "flipfree/numeric/big_float.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::seamless {

using Wide = numeric::BigFloat<16>;
// Mantissa of numbers that come from doubles; those of finer metrics keep their own.
inline constexpr int kWideBits = 192;

struct WideVector {
  Wide x, y;

  friend WideVector operator+(const WideVector& a, const WideVector& b) {
    return {a.x + b.x, a.y + b.y};
  }
  friend WideVector operator-(const WideVector& a, const WideVector& b) {
    return {a.x - b.x, a.y - b.y};
  }
  WideVector operator-() const { return {-x, -y}; }
  friend WideVector operator*(const Wide& s, const WideVector& a) { return {s * a.x, s * a.y}; }
};

inline Wide dot(const WideVector& a, const WideVector& b) { return a.x * b.x + a.y * b.y; }
inline Wide cross(const WideVector& a, const WideVector& b) { return a.x * b.y - a.y * b.x; }
inline Wide norm(const WideVector& a) { return sqrt(dot(a, a)); }

// Counter-clockwise by so many quarter turns, without rounding.
inline WideVector turned(const WideVector& a, Index quarter_turns) {
  switch (quarter_turns & 3) {
    case 1:
      return {-a.y, a.x};
    case 2:
      return {-a.x, -a.y};
    case 3:
      return {a.y, -a.x};
    default:
      return a;
  }
}

// The quarter turns, 0 to 3, that bring `a` nearest to the direction of `b`.
inline Index turns_between(const WideVector& a, const WideVector& b) {
  const Wide d = dot(a, b), c = cross(a, b);
  if (abs(d) >= abs(c)) return d.sign() >= 0 ? 0 : 2;
  return c.sign() >= 0 ? 1 : 3;
}

}  // namespace flipfree::seamless
