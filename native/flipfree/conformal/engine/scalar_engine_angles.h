// Angles, gradient, cotangents and the energy of ScalarEngine's present metric.
// Private to the engines' translation units.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "flipfree/base/parallel.h"
#include "flipfree/conformal/engine/scalar_engine.h"
#include "flipfree/numeric/lobachevsky.h"

namespace flipfree::conformal {

// A face that counts, as the loops below see it.
template <typename T>
struct ScalarEngine<T>::Shape {
  double weight = 0.0;
  HalfedgeId h[3];
  intrinsic::TriangleShape shape;
  int widest = 0;
};

// Calls visit(shape) for the faces [begin, end) that count; accuracy as in shape(). Returns the
// smallest radius, 1 if there is none.
template <typename T>
template <typename Visit>
inline double ScalarEngine<T>::visit_faces(std::size_t begin, std::size_t end, double accuracy,
                                           const Visit& visit) const {
  double smallest = 1.0;
  Shape face;
  for (std::size_t f = begin; f < end; ++f) {
    face.weight = face_weight(f);
    if (face.weight == 0.0) continue;
    face.shape = metric_.shape(f, accuracy, face.h);
    face.widest = widest_of(face.shape.x);
    smallest = std::min(smallest, face.shape.radius);
    visit(face);
  }
  return smallest;
}

template <typename T>
template <typename Visit>
inline double ScalarEngine<T>::visit_all_faces(double accuracy, ExecutionContext& context,
                                               const Visit& visit) const {
  double smallest = 1.0;
  for (std::size_t begin = 0; begin < mesh().face_count(); begin += kCheckLogarithms) {
    context.check();
    const std::size_t end = std::min(mesh().face_count(), begin + kCheckLogarithms);
    smallest = std::min(smallest, visit_faces(begin, end, accuracy, visit));
  }
  return smallest;
}

// In two sweeps: angles on all threads, then their sums, always in the same order.
template <typename T>
void ScalarEngine<T>::evaluate(double accuracy, Gradient& out, ExecutionContext& context) {
  if constexpr (!Traits::kIsDouble) {
    if (accuracy < 1e-14) {
      evaluate_exactly(out, context);
      return;
    }
  }
  out.value.resize(target_.size());
  std::copy(target_.begin(), target_.end(), out.value.begin());
  out.half_cotangent.assign(mesh().halfedge_count(), 0.0);
  angle_.assign(mesh().halfedge_count(), 0.0);
  std::vector<double> smallest(
      chunk_count(mesh().face_count(), intrinsic::ChecksPer<double>::kLogarithms), 1.0);
  parallel_for(context, mesh().face_count(), intrinsic::ChecksPer<double>::kLogarithms,
               [&](std::size_t begin, std::size_t end, std::size_t chunk) {
                 smallest[chunk] = visit_faces(begin, end, accuracy, [&](const Shape& face) {
                   // tan(angle / 2) = radius / x; the two smallest angles are computed, the third
                   // completes pi.
                   double rest = 0.5 * kPi;
                   double angle[3];
                   for (int k = 0; k < 3; ++k) {
                     const double t = face.shape.half_tangent(k);
                     if (k != face.widest) {
                       angle[k] = std::atan(t);
                       rest -= angle[k];
                     }
                     if (mesh().label_of_edge(face.h[k] >> 1) != intrinsic::EdgeLabel::kDiagonal)
                       out.half_cotangent[at(face.h[k])] = 0.25 * face.weight * (1.0 / t - t);
                   }
                   angle[face.widest] = rest;
                   // The angle opposite h[k] sits at the origin of h[k + 2].
                   for (int k = 0; k < 3; ++k)
                     angle_[at(face.h[(k + 2) % 3])] = 2.0 * face.weight * angle[k];
                 });
               });
  for (std::size_t h = 0; h < angle_.size(); ++h)
    out.value[unknown_at(static_cast<HalfedgeId>(h))] -= angle_[h];
  repair_weights(out);
  out.noise = noise_of(*std::min_element(smallest.begin(), smallest.end()), 2.2e-16);
  if constexpr (!Traits::kIsDouble) out.noise = std::max(out.noise, accuracy);
  finish_gradient(out);
}

template <typename T>
void ScalarEngine<T>::half_tangents(std::vector<double>& tangent, ExecutionContext& context) const {
  tangent.resize(mesh().halfedge_count());
  parallel_for(context, mesh().face_count(), kCheckLogarithms,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 HalfedgeId h[3];
                 for (std::size_t f = begin; f < end; ++f) {
                   const intrinsic::TriangleShape shape = metric_.shape(f, kEnergyAccuracy, h);
                   for (int k = 0; k < 3; ++k) tangent[at(h[k])] = shape.half_tangent(k);
                 }
               });
}

// The longest side less the second is exact where it decides, as the two are nearly equal there.
// finish() moves each side by one rounding, 2 * 2^-bits of the longest in all.
template <typename T>
bool ScalarEngine<T>::has_triangles() const {
  const std::vector<T>& length = metric_.lengths();
  const T room = Traits::power_of_two(2 - bits_, bits_);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mesh().halfedge_count()); ++h) {
    const T& longest = length[at(h >> 1)];
    const T* second = &length[at(mesh().next[at(h)] >> 1)];
    const T* third = &length[at(mesh().previous(h) >> 1)];
    if (*second < *third) std::swap(second, third);
    if (longest < *second) continue;
    if (!((longest - *second) + room * longest < *third)) return false;
  }
  return true;
}

// Sum over triangles of 2 f - pi (x1 + x2 + x3) plus target * u, with x the logarithms of the
// lengths and f = sum of angle * x + Lobachevsky(angle). The edges' own term makes the sum
// continuous across flips: on a co-circular edge it cancels what the two opposite angles add.
template <typename T>
Energy ScalarEngine<T>::energy(ExecutionContext& context) const {
  const std::vector<T>& length = metric_.lengths();
  std::vector<double> logarithm(length.size());
  for (std::size_t e = 0; e < length.size(); ++e) {
    if (e % intrinsic::ChecksPer<double>::kLogarithms ==
        intrinsic::ChecksPer<double>::kLogarithms - 1)
      context.check();
    logarithm[e] = logarithm_of(length[e]);
  }
  Energy sum;
  const auto add = [&sum](double term) {
    sum.value += term;
    sum.noise += kEnergyRoundings * std::numeric_limits<double>::epsilon() * std::abs(term);
  };
  visit_all_faces(kEnergyAccuracy, context, [&](const Shape& face) {
    double half[3];
    half[face.widest] = 0.5 * kPi;
    for (int k = 0; k < 3; ++k) {
      if (k == face.widest) continue;
      half[k] = std::atan(face.shape.half_tangent(k));
      half[face.widest] -= half[k];
    }
    for (int k = 0; k < 3; ++k) {
      add(face.weight * ((4.0 * half[k] - kPi) * logarithm[at(face.h[k] >> 1)]));
      add(face.weight * 2.0 * numeric::lobachevsky(2.0 * half[k]));
    }
  });
  for (std::size_t v = 0; v < target_.size(); ++v)
    add(target_[v] * 2.0 * logarithm_of(factor_product_[v]));
  return sum;
}

// The half-cotangents of the two angles opposite an edge are huge and opposite where the angles
// are nearly 0 and nearly pi. With t = tan(angle / 2) their sum is a quarter of
// (t1 + t2) (1 - t1 t2) / (t1 t2); where it cancels in double, 1 - (t1 t2)^2 is computed in full.
// So is 1 - t^2 where both angles are so nearly right that doubles see nothing of a weight that may
// be all that holds a vertex.
template <typename T>
inline void ScalarEngine<T>::repair_weights(Gradient& out) const {
  if constexpr (!Traits::kIsDouble) {
    for (std::size_t h = 0; h < out.half_cotangent.size(); h += 2) {
      const double a = out.half_cotangent[h];
      const double b = out.half_cotangent[h + 1];
      if (std::abs(a) + std::abs(b) < kRight) {
        for (const std::size_t k : {h, h + 1}) repair_right_angle(k, out);
        continue;
      }
      if (!(std::abs(a + b) < kCancelled * (std::abs(a) + std::abs(b)))) continue;
      const double weight = face_weight(at(mesh().face[h]));
      if (weight != face_weight(at(mesh().face[h + 1]))) continue;
      const T one_square = half_tangent_square(static_cast<HalfedgeId>(h));
      const T other_square = half_tangent_square(static_cast<HalfedgeId>(h + 1));
      const double one = std::sqrt(Traits::to_double(one_square));
      const double other = std::sqrt(Traits::to_double(other_square));
      const double rest = Traits::to_double(T(1.0) - one_square * other_square);
      const double product = one * other;
      out.half_cotangent[h] = 0.25 * weight * (one + other) * (rest / (1.0 + product)) / product;
      out.half_cotangent[h + 1] = 0.0;
    }
  }
}

template <typename T>
inline void ScalarEngine<T>::repair_right_angle(std::size_t h, Gradient& out) const {
  const double weight = face_weight(at(mesh().face[h]));
  const bool diagonal =
      mesh().label_of_edge(static_cast<EdgeId>(h >> 1)) == intrinsic::EdgeLabel::kDiagonal;
  if (weight == 0.0 || diagonal) return;
  const T square = half_tangent_square(static_cast<HalfedgeId>(h));
  if (!(square > T(0.0))) return;
  out.half_cotangent[h] =
      0.25 * weight * Traits::to_double(T(1.0) - square) / std::sqrt(Traits::to_double(square));
}

// tan^2 of half the angle opposite h.
template <typename T>
inline T ScalarEngine<T>::half_tangent_square(HalfedgeId h) const {
  const HalfedgeId n = mesh().next[at(h)];
  return intrinsic::half_tangent_square(metric_.length(h), metric_.length(n),
                                        metric_.length(mesh().next[at(n)]));
}

template <typename T>
inline void ScalarEngine<T>::finish_gradient(Gradient& out) {
  out.max_error = 0.0;
  for (const double g : out.value) {
    const double error = std::isnan(g) ? std::numeric_limits<double>::infinity() : std::abs(g);
    out.max_error = std::max(out.max_error, error);
  }
}

// Everything in T, for accuracies beyond double. Target angles are doubles; what their sum misses
// of Gauss-Bonnet by rounding is spread evenly, since no metric could meet it.
template <typename T>
inline void ScalarEngine<T>::evaluate_exactly(Gradient& out, ExecutionContext& context) {
  using std::atan2;
  using std::sqrt;
  const std::size_t unknowns = target_.size();
  if (exact_target_.empty()) spread_remainder();
  sums_ = exact_target_;
  out.value.resize(unknowns);
  out.half_cotangent.assign(mesh().halfedge_count(), 0.0);
  const T half_pi = Traits::pi(bits_) / T(2.0);
  const double smallest = visit_all_faces(0.0, context, [&](const Shape& face) {
    const auto& h = face.h;
    const T& a = metric_.length(h[0]);
    const T& b = metric_.length(h[1]);
    const T& c = metric_.length(h[2]);
    const T s = a + b + c;
    T y[3] = {b - a + c, c - b + a, a - c + b};
    for (T& difference : y) {
      if (!(difference > T(0.0))) difference = s * Traits::power_of_two(-bits_, bits_);
    }
    const T r = sqrt((y[0] / s) * y[1] * y[2]);
    T rest = half_pi;
    const T twice = T(2.0 * face.weight);
    for (int k = 0; k < 3; ++k) {
      const double t = face.shape.half_tangent(k);
      if (mesh().label_of_edge(h[k] >> 1) != intrinsic::EdgeLabel::kDiagonal) {
        out.half_cotangent[at(h[k])] = 0.25 * face.weight * (1.0 / t - t);
      }
      if (k == face.widest) continue;
      const T angle = atan2(r, y[k]);
      rest -= angle;
      sums_[unknown_at(h[(k + 2) % 3])] -= twice * angle;
    }
    sums_[unknown_at(h[(face.widest + 2) % 3])] -= twice * rest;
  });
  for (std::size_t v = 0; v < unknowns; ++v) out.value[v] = Traits::to_double(sums_[v]);
  repair_weights(out);
  out.noise = noise_of(smallest, std::ldexp(1.0, 2 - bits_));
  finish_gradient(out);
}

template <typename T>
inline void ScalarEngine<T>::spread_remainder() {
  const std::size_t unknowns = target_.size();
  // Angles of all triangles sum to pi per triangle of the user's mesh.
  const std::size_t triangles = input_.setup.input_halfedge.size() / 3;
  const T total = Traits::pi(bits_) * T(static_cast<double>(triangles));
  T sum = Traits::make(0.0, bits_);
  for (const double t : target_) sum += T(t);
  const T share = (total - sum) / T(static_cast<double>(unknowns));
  exact_target_.resize(unknowns);
  for (std::size_t v = 0; v < unknowns; ++v) exact_target_[v] = T(target_[v]) + share;
}

}  // namespace flipfree::conformal
