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

// A similarity without reflection: w = a z + b over complex numbers.
struct Similarity {
  Vector2 linear = Vector2(1.0, 0.0);  // a = linear.x + i linear.y
  Vector2 translation = Vector2::Zero();
  Vector2 operator()(const Vector2& p) const {
    return {linear.x() * p.x() - linear.y() * p.y() + translation.x(),
            linear.y() * p.x() + linear.x() * p.y() + translation.y()};
  }
};

// Every point carried.
inline Points2 moved(const Similarity& similarity, const Points2& uv) {
  Points2 result(uv.rows(), 2);
  for (Eigen::Index v = 0; v < uv.rows(); ++v)
    result.row(v) = similarity(uv.row(v).transpose()).transpose();
  return result;
}

// With this linear part, the one that carries the mean of the points `from` to that of `to`.
inline Similarity about_means(const Vector2& linear, const Points2& from, const Points2& to) {
  const Vector2 middle = from.colwise().mean().transpose();
  const Similarity turn{linear, Vector2::Zero()};
  return {linear, to.colwise().mean().transpose() - turn(middle)};
}

// The one that carries the points `from` to `to` best in the least-squares sense. Identity scale if
// the points coincide.
inline Similarity fit_similarity(const Points2& from, const Points2& to) {
  const Points2 p = from.rowwise() - from.colwise().mean();
  const Points2 q = to.rowwise() - to.colwise().mean();
  const Vector2 product(p.cwiseProduct(q).sum(), p.col(0).dot(q.col(1)) - p.col(1).dot(q.col(0)));
  const double square = p.squaredNorm();
  return about_means(
      square > 0.0 && product.norm() > 0.0 ? Vector2(product / square) : Vector2(1.0, 0.0), from,
      to);
}
// The best of those that scale by so much.
inline Similarity fit_motion(const Points2& from, const Points2& to, double scale = 1.0) {
  const Vector2 linear = fit_similarity(from, to).linear;
  const double length = linear.norm();
  return about_means(
      std::isnormal(length) ? Vector2(linear * (scale / length)) : Vector2(scale, 0.0), from, to);
}

// What is left of a coordinate once it is stored in 32 bits (G1), as a double again.
//
// Written out, `static_cast<double>(static_cast<float>(x))` is a conversion there and back that a
// compiler may take for nothing: GCC 12's straight-line vectorizer does with pairs of them, and
// what was certified as stored was not. So the value goes through a memory cell that no optimiser
// may skip, and this is the one place that does it (tests/native/base/stored_test.cpp).

inline double as_stored(double x) {
  volatile float cell = static_cast<float>(x);
  return cell;
}

inline Vector2 as_stored(const Vector2& p) { return {as_stored(p.x()), as_stored(p.y())}; }

inline Points2 as_stored(Points2 points) {
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = as_stored(points.data()[i]);
  return points;
}

}  // namespace flipfree
