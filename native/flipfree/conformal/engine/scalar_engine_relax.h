// Nonlinear relaxation of ScalarEngine: vertices that solve their own equation, and their stars.
// Private to the engines' translation units.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "flipfree/conformal/engine/scalar_engine.h"

namespace flipfree::conformal {
template <typename T>
bool ScalarEngine<T>::relax(const std::vector<VertexId>& unknowns, double accuracy,
                            const std::function<bool()>& stop, ExecutionContext& context) {
  index_stars();
  metric_.round_lengths();
  metric_.clear_line();  // of a move that could not be followed
  const std::size_t most_flips = metric_.flips().size() + kRelaxFlips * mesh().edge_count();
  for (const VertexId v : unknowns) {
    context.check();
    if (metric_.flips().size() > most_flips || stop()) break;
    if (!relax_one(v, accuracy, context)) return false;
  }
  return true;
}

// The root lies between low and high, distances from where the vertex is: they shrink with the
// steps, so that roots are found to far more places than an offset from the start has. Newton's
// method; once the root was passed, a step that gains little or leads too far halves the distance.
template <typename T>
inline bool ScalarEngine<T>::relax_one(VertexId v, double accuracy, ExecutionContext& context) {
  constexpr double kFarEnd = 16.0;
  const double least_move = std::ldexp(1.0, -bits_);
  double low = -kRelaxMove;
  double high = kRelaxMove;
  double before = 0.0;
  bool passed = false;  // both signs were seen
  for (int i = 0; i < kRelaxSteps; ++i) {
    if (i % 16 == 15) context.check();
    const StarAngle star = star_angle(v);
    const double error = target_[at(v)] - star.angle;
    if (!std::isfinite(error)) return false;
    if (std::abs(error) <= accuracy) return true;
    passed = passed || before * error < 0.0;
    const bool slow = i > 0 && std::abs(error) > 0.5 * std::abs(before);
    before = error;
    // The error grows with the scale factor.
    (error > 0.0 ? high : low) = 0.0;
    const double end = error > 0.0 ? low : high;
    double step = star.slope > 0.0 ? -error / star.slope : end;
    const bool within = std::abs(step) < std::abs(end);
    if (!within) step = end;
    if (passed && (slow || !within)) {
      // Near the vertex the root may be nearer by many orders of magnitude than the end is.
      const double distance = std::abs(end);
      step = std::copysign(
          distance > kFarEnd * star.reach ? std::sqrt(distance * star.reach) : 0.5 * distance, end);
    }
    if (!(std::abs(step) > least_move)) return true;
    if (!scale_star(v, std::expm1(0.5 * step), context)) return false;
    low -= step;
    high -= step;
  }
  return true;
}

template <typename T>
inline void ScalarEngine<T>::index_stars() {
  metric_.index_stars();
  mirror_.assign(target_.size(), kInvalid);
  for (std::size_t v = target_.size(); v < mesh().vertex_count(); ++v) {
    mirror_[at(mesh().unknown[v])] = static_cast<VertexId>(v);
  }
}

template <typename T>
inline auto ScalarEngine<T>::star_angle(VertexId v) const -> StarAngle {
  StarAngle star;
  const auto corner = [&](HalfedgeId out) {
    HalfedgeId h[3];
    const intrinsic::TriangleShape shape =
        metric_.shape(at(mesh().face[at(out)]), kStarAccuracy, h);
    const auto& [x, radius] = shape;
    // out = h[k]; its corner is opposite h[k + 1]; the angles that act on it are opposite h[k]
    // and h[k + 2].
    const int k = h[0] == out ? 0 : h[1] == out ? 1 : 2;
    const int o = (k + 1) % 3;
    const int p = (k + 2) % 3;
    star.angle += std::atan(radius / x[o]);
    // 1 / t - t with t = radius / x, but for edges from the unknown to itself: they scale as a
    // whole and turn nothing. A hub has many of them.
    if (unknown_at(h[o]) != at(v)) star.slope += x[k] / radius - radius / x[k];
    if (unknown_at(h[p]) != at(v)) star.slope += x[p] / radius - radius / x[p];
    // A change g of the scale factor changes the x by the parts (1 + x[o]) g / (4 x[o]) and
    // (x[k] - x[p]) g / (4 x[k]).
    const double turn = std::abs(x[k] - x[p]);
    star.reach =
        std::min(star.reach, 4.0 * std::min(x[o] / (1.0 + x[o]), std::min(x[k], x[p]) / turn));
  };
  metric_.around(v, corner);
  if (mesh().symmetric()) {
    if (mirror_[at(v)] != kInvalid) metric_.around(mirror_[at(v)], corner);
  }
  const double share = !mesh().symmetric() ? 1.0 : 0.5;
  star.slope *= 0.25 * share;
  star.angle *= 2.0 * share;
  return star;
}

template <typename T>
inline bool ScalarEngine<T>::scale_star(VertexId v, double growth, ExecutionContext& context) {
  const T factor = T(1.0) + Traits::make(growth, bits_);
  factor_product_[at(v)] *= factor;
  if (!intrinsic::is_usable_length(factor_product_[at(v)])) return false;
  const auto scale_one = [&](HalfedgeId h) {
    metric_.scale_length(h >> 1, factor);
    metric_.put_in_line(h >> 1);
    metric_.put_in_line(mesh().next[at(h)] >> 1);
  };
  metric_.around(v, scale_one);
  if (mesh().symmetric() && mirror_[at(v)] != kInvalid) metric_.around(mirror_[at(v)], scale_one);
  return metric_.template empty_line<FlipRule::kPtolemy>(context);
}

}  // namespace flipfree::conformal
