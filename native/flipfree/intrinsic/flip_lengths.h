// Lengths of an intrinsic triangulation: at the start, and those that the seven symmetric flips
// create, in closed form, by Ptolemy's theorem (equation 4.6, any Penner coordinates) and in the
// Euclidean metric of the start. Letters as in
// symmetric_flips.cpp: the flip exchanges p = (a, c) [and its mirror image] for z = (b, b'); x =
// (a, b), y = (b, c), w = (a, a'), v = (c, c').
//
// A symmetric quadrilateral with parallel sides s, t and legs l is an inscribed trapezoid, so its
// diagonal d satisfies d^2 = l^2 + s t under every symmetric metric.
#pragma once

#include <cmath>
#include <vector>

#include "flipfree/intrinsic/symmetric_flips.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {

// Distances in space between the ends of every edge, #E, with `bits` mantissa bits.
// `positions`: of the user's vertices.
template <typename T>
std::vector<T> euclidean_lengths(const IntrinsicMesh& mesh, const Points3& positions, int bits) {
  using std::sqrt;
  using Traits = numeric::ScalarTraits<T>;
  const auto end = [&](std::size_t h) { return positions.row(mesh.unknown[at(mesh.origin[h])]); };
  std::vector<T> length(mesh.edge_count());
  for (std::size_t e = 0; e < length.size(); ++e) {
    const auto a = end(2 * e);
    const auto b = end(2 * e + 1);
    T sum = Traits::make(0.0, bits);
    for (int k = 0; k < 3; ++k) {
      const T d = Traits::make(a[k], bits) - Traits::make(b[k], bits);
      sum += d * d;
    }
    length[e] = sqrt(sum);
  }
  return length;
}

template <typename T>
class FlipLengths {
 public:
  explicit FlipLengths(std::vector<T>& length) : length_(length) {}

  // Lengths before the flip are read, lengths of the edges that the flip creates are written;
  // connectivity is not needed. Each formula composes 4.6 along the plain flips, with no
  // subtraction, so relative errors stay small.
  void ptolemy(const FlipStencil& s) {
    switch (s.type) {
      case FlipType::kInterior:
      case FlipType::kParallel:
      case FlipType::kPerpendicular: {
        const T z = (at(s.jk) / at(s.e)) * at(s.im) + (at(s.ki) / at(s.e)) * at(s.mj);
        set(s.new_side, z);
        if (s.new_side2 != kInvalid) set(s.new_side2, z);
        return;
      }
      case FlipType::kTriangle: {
        const T p = at(s.e);
        const T d = at(s.x) + (at(s.w) / p) * at(s.y);
        const T z = (at(s.y) / p) * (at(s.x) + d);
        set(s.new_diagonal, d);
        set(s.new_cross, z);
        return;
      }
      case FlipType::kTriangleQuad: {
        const T p = (at(s.y) / at(s.e)) * (at(s.x) + at(s.diagonal));
        set(s.new_side, p);
        set(s.new_side2, p);
        return;
      }
      case FlipType::kQuad: {
        const T p = at(s.e);
        const T& d = at(s.diagonal);
        const T da = (at(s.x) / p) * d + (at(s.w) / p) * at(s.y);
        const T dc = (at(s.v) / p) * at(s.x) + (at(s.y) / p) * d;
        const T z = (at(s.y) / p) * da + (at(s.x) / p) * dc;
        set_quads(s, da, dc, z);
        return;
      }
      case FlipType::kQuadQuad: {
        const T z = at(s.e);
        const T da = at(s.diagonal);
        const T dc = at(s.diagonal2);
        const T p = (at(s.x) / z) * dc + (at(s.y) / z) * da;
        const T d = (at(s.x) / z) * at(s.y) + (da / z) * dc;
        set(s.new_side, p);
        set(s.new_side2, p);
        set(s.new_diagonal, d);
        return;
      }
    }
  }

  // The same in the Euclidean metric: both sides of the edge are unfolded into the plane.
  void euclidean(const FlipStencil& s) {
    const T half = number(0.5);
    switch (s.type) {
      case FlipType::kInterior: {
        const T c = at(s.e);
        const Apex k = apex(c, at(s.ki), at(s.jk));
        const Apex m = apex(c, at(s.im), at(s.mj));
        const T z = hypotenuse(k.along - m.along, k.height + m.height);
        set(s.new_side, z);
        if (s.new_side2 != kInvalid) set(s.new_side2, z);
        return;
      }
      case FlipType::kParallel:
      case FlipType::kPerpendicular: {
        const T c = at(s.e);
        set(s.e, apex(c, at(s.ki), at(s.jk)).height + apex(c, at(s.im), at(s.mj)).height);
        return;
      }
      case FlipType::kTriangle:
      case FlipType::kQuad: {
        // a = (w/2, 0), c = (v/2, h), with v = 0 for a triangle; b lies to the right of the line
        // from a to c.
        const bool quad = s.type == FlipType::kQuad;
        const T p = at(s.e);
        const T w = at(s.w);
        const T v = quad ? at(s.v) : number(0.0);
        const T x = at(s.x);
        const T y = at(s.y);
        const T lean = half * (v - w);
        const T h = leg(p, lean);
        const Apex b = apex(p, x, y);
        const T z = w + number(2.0) * ((b.along / p) * lean + (b.height / p) * h);
        const T da = trapezoid_diagonal(x, w, z);
        if (quad) {
          set_quads(s, da, trapezoid_diagonal(y, v, z), z);
        } else {
          set(s.new_diagonal, da);
          set(s.new_cross, z);
        }
        return;
      }
      case FlipType::kTriangleQuad:
      case FlipType::kQuadQuad: {
        const bool quad = s.type == FlipType::kQuadQuad;
        const T z = at(s.e);
        const T w = at(s.w);
        const T v = quad ? at(s.v) : number(0.0);
        const T height = leg(at(s.x), half * (z - w)) + leg(at(s.y), half * (z - v));
        const T p = hypotenuse(half * (v - w), height);
        set(s.new_side, p);
        set(s.new_side2, p);
        if (quad) set(s.new_diagonal, trapezoid_diagonal(p, w, v));
        return;
      }
    }
  }

  // Sets the length of the diagonal e of a symmetric quadrilateral by those of its sides.
  void symmetric_diagonal(const IntrinsicMesh& mesh, EdgeId e) {
    T leg = number(0.0);
    T parallel[2] = {leg, leg};
    for (int side = 0; side < 2; ++side) {
      HalfedgeId h = 2 * e + side;
      for (int k = 0; k < 2; ++k) {
        h = mesh.next_of(h);
        const bool across = mesh.label_of_edge(h >> 1) == EdgeLabel::kPerpendicular;
        (across ? parallel[side] : leg) = at(h >> 1);
      }
    }
    using std::sqrt;
    // As quotients: the squares may leave the exponent range.
    const T& unit = parallel[0] < parallel[1] ? parallel[1] : parallel[0];
    const T scale = unit < leg ? leg : unit;
    const T a = leg / scale;
    set(e, scale * sqrt(a * a + (parallel[0] / scale) * (parallel[1] / scale)));
  }

 private:
  using Traits = numeric::ScalarTraits<T>;
  struct Apex {
    T along;  // foot of the height, measured from the start of the base
    T height;
  };

  const T& at(EdgeId e) const { return length_[static_cast<std::size_t>(e)]; }
  void set(EdgeId e, const T& value) { length_[static_cast<std::size_t>(e)] = value; }
  void set_quads(const FlipStencil& s, const T& da, const T& dc, const T& z) {
    // The flipped edge becomes the diagonal of the quadrilateral at that end at which its own
    // triangle was closed.
    set(s.new_diagonal, da);
    set(s.new_diagonal2, dc);
    set(s.new_cross, z);
  }
  static T number(double value) { return T(value); }
  static T hypotenuse(const T& a, const T& b) {
    using std::sqrt;
    return sqrt(a * a + b * b);
  }
  // Second leg of a right triangle.
  static T leg(const T& hypotenuse, const T& first) {
    using std::sqrt;
    const T square = (hypotenuse - first) * (hypotenuse + first);
    return square > number(0.0) ? sqrt(square) : number(0.0);
  }
  static T trapezoid_diagonal(const T& side, const T& s, const T& t) {
    using std::sqrt;
    return sqrt(side * side + s * t);
  }
  // Apex over a base, given the side at the base's start and the one at its end.
  static Apex apex(const T& base, const T& at_start, const T& at_end) {
    using std::sqrt;
    const T two = number(2.0);
    const T along = (base + ((at_start - at_end) / base) * (at_start + at_end)) / two;
    const T s = base + at_start + at_end;
    const T square = s * ((at_start - base) + at_end) * ((at_end - at_start) + base) *
                     ((at_start - at_end) + base);
    return {along, square > number(0.0) ? sqrt(square) / (two * base) : number(0.0)};
  }

  std::vector<T>& length_;
};

}  // namespace flipfree::intrinsic
