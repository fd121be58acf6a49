// Nonlinear relaxation of ScalarEngine: vertices that solve their own equation, and their stars.
// Private to the engines' translation units.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "flipfree/conformal/scalar_engine.h"
#include "flipfree/conformal/scalar_engine_flips.h"

namespace flipfree::conformal {

template <typename T>
bool ScalarEngine<T>::relax(const std::vector<VertexId>& unknowns, double accuracy,
                            const std::function<bool()>& stop, ExecutionContext& context) {
  index_stars();
  refresh_shadow();
  const double least_move = std::ldexp(1.0, -bits_);
  const std::size_t most_flips = flips_.size() + kRelaxFlips * mesh_.edge_count();
  for (const VertexId v : unknowns) {
    context.check();
    if (flips_.size() > most_flips || stop()) break;
    // The root lies between low and high, distances from where the vertex is: they shrink with
    // the steps, so that roots are found to far more places than an offset from the start has.
    double low = -kRelaxMove;
    double high = kRelaxMove;
    bool passed = false;  // both signs were seen
    double before = 0.0;
    double last = 0.0;
    for (int i = 0; i < kRelaxSteps; ++i) {
      double slope = 0.0;
      const double error = target_[at(v)] - star_angle(v, slope);
      if (!std::isfinite(error)) return false;
      if (std::abs(error) <= accuracy) break;
      // The error grows with the scale factor.
      (error > 0.0 ? high : low) = 0.0;
      passed = passed || before * error < 0.0;
      const bool slow = i > 0 && std::abs(error) > 0.5 * std::abs(before);
      before = error;
      double step = slope > 0.0 ? -error / slope : (error > 0.0 ? -1.0 : 1.0);
      if (slow && !passed && std::abs(step) < 2.0 * std::abs(last)) step = 2.0 * last;
      if ((slow && passed) || !(step > low && step < high)) step = 0.5 * (low + high);
      last = step;
      if (!(std::abs(step) > least_move)) break;
      low -= step;
      high -= step;
      if (!scale_star(v, std::expm1(0.5 * step), context)) return false;
    }
  }
  return true;
}

// An outgoing half-edge of every vertex, kept through flips once it exists.
template <typename T>
inline void ScalarEngine<T>::index_stars() {
  if (!star_.empty()) return;
  star_.resize(mesh_.vertex_count());
  mirror_.assign(target_.size(), kInvalid);
  for (std::size_t h = 0; h < mesh_.halfedge_count(); ++h)
    star_[at(mesh_.origin[h])] = static_cast<HalfedgeId>(h);
  for (std::size_t v = target_.size(); v < mesh_.vertex_count(); ++v) {
    mirror_[at(mesh_.unknown[v])] = static_cast<VertexId>(v);
  }
}

// Total angle at an unknown (half of it per copy if the mesh is symmetric) and its Hessian
// diagonal.
template <typename T>
inline double ScalarEngine<T>::star_angle(VertexId v, double& slope) const {
  double sum = 0.0;
  slope = 0.0;
  const auto corner = [&](HalfedgeId out) {
    HalfedgeId h[3];
    double x[3];
    const double radius = shape(at(mesh_.face[at(out)]), h, x);
    // out = h[k]; its corner is opposite h[k + 1]; the angles that act on it are opposite h[k]
    // and h[k + 2].
    const int k = h[0] == out ? 0 : h[1] == out ? 1 : 2;
    sum += std::atan(radius / x[(k + 1) % 3]);
    // 1 / t - t with t = radius / x, but for edges from the unknown to itself: they scale as a
    // whole and turn nothing. A hub has many of them.
    const int p = (k + 2) % 3;
    if (unknown_at(h[(k + 1) % 3]) != at(v)) slope += x[k] / radius - radius / x[k];
    if (unknown_at(h[p]) != at(v)) slope += x[p] / radius - radius / x[p];
  };
  around(v, corner);
  if (mesh_.symmetric()) {
    if (mirror_[at(v)] != kInvalid) around(mirror_[at(v)], corner);
  }
  const double share = !mesh_.symmetric() ? 1.0 : 0.5;
  slope *= 0.25 * share;
  return 2.0 * share * sum;
}

template <typename T>
inline bool ScalarEngine<T>::scale_star(VertexId v, double growth, ExecutionContext& context) {
  const T factor = T(1.0) + Traits::make(growth, bits_);
  factor_product_[at(v)] *= factor;
  stack_.clear();
  const auto scale_one = [&](HalfedgeId h) {
    length_[at(h >> 1)] *= factor;
    update_shadow(h >> 1);
    push(h >> 1);
    push(mesh_.next[at(h)] >> 1);
  };
  around(v, scale_one);
  if (mesh_.symmetric() && mirror_[at(v)] != kInvalid) around(mirror_[at(v)], scale_one);
  return empty_stack<true>(context);
}

}  // namespace flipfree::conformal
