// Delaunay flips of ScalarEngine: the test with its filter in double, the stack of edges.
// Private to the engines' translation units.
#pragma once

#include <cstddef>

#include "flipfree/conformal/engine/scalar_engine.h"
#include "flipfree/intrinsic/delaunay_test.h"
#include "flipfree/intrinsic/flip_lengths.h"

namespace flipfree::conformal {

template <typename T>
inline bool ScalarEngine<T>::violates_delaunay(EdgeId e) {
  const HalfedgeId h = 2 * e;
  const HalfedgeId hn = mesh_.next[at(h)];
  const HalfedgeId hp = mesh_.next[at(hn)];
  const HalfedgeId on = mesh_.next[at(h + 1)];
  const HalfedgeId op = mesh_.next[at(on)];
  const std::size_t i[5] = {at(e), at(hn >> 1), at(hp >> 1), at(on >> 1), at(op >> 1)};
  if constexpr (Traits::kIsDouble) {
    return intrinsic::delaunay_sign(length_[i[0]], length_[i[1]], length_[i[2]], length_[i[3]],
                                    length_[i[4]]) < 0;
  } else {
    if (shadow_valid_) {
      const int sign = intrinsic::delaunay_sign(shadow_[i[0]], shadow_[i[1]], shadow_[i[2]],
                                                shadow_[i[3]], shadow_[i[4]]);
      if (sign != 0) return sign < 0;
    }
    ++exact_tests_;
    return intrinsic::violates_delaunay_in_full(length_[i[0]], length_[i[1]], length_[i[2]],
                                                length_[i[3]], length_[i[4]], bits_);
  }
}

// Doubles of all lengths for the filter, unless some leave a safe part of the exponent range.
template <typename T>
inline void ScalarEngine<T>::refresh_shadow() {
  if constexpr (!Traits::kIsDouble) {
    shadow_.resize(length_.size());
    shadow_valid_ = true;
    for (std::size_t e = 0; e < length_.size(); ++e) {
      shadow_[e] = Traits::to_double(length_[e]);
      if (!(shadow_[e] > 1e-280 && shadow_[e] < 1e280)) {
        shadow_valid_ = false;
        return;
      }
    }
  }
}

template <typename T>
inline void ScalarEngine<T>::update_shadow(EdgeId e) {
  if constexpr (!Traits::kIsDouble) {
    if (e == kInvalid || !shadow_valid_) return;
    shadow_[at(e)] = Traits::to_double(length_[at(e)]);
    if (!(shadow_[at(e)] > 1e-280 && shadow_[at(e)] < 1e280)) shadow_valid_ = false;
  }
}

template <typename T>
inline void ScalarEngine<T>::push(EdgeId e) {
  if (mesh_.symmetric()) {
    const intrinsic::EdgeLabel label = mesh_.edge_label[at(e)];
    if (label == intrinsic::EdgeLabel::kDiagonal) return;
    if (label == intrinsic::EdgeLabel::kTwo) e = mesh_.reflection[at(2 * e)] >> 1;
  }
  if (queued_[at(e)] != 0) return;
  queued_[at(e)] = 1;
  stack_.push_back(e);
}

// Terminates: each flip strictly lowers the hyperbolic Delaunay functional (Weeks), and flips
// happen only where the criterion is violated beyond rounding; the cap is a guard against what
// rounding could still do.
template <typename T>
template <bool kPtolemy>
inline bool ScalarEngine<T>::flip_to_delaunay(ExecutionContext& context) {
  const std::size_t edges = mesh_.edge_count();
  stack_.clear();
  refresh_shadow();
  intrinsic::FlipType type = intrinsic::FlipType::kInterior;
  for (std::size_t e = edges; e-- > 0;) {
    if (e % kCheckTests == 0) context.check();
    queued_[e] = 0;
    if (violates_delaunay(static_cast<EdgeId>(e)) &&
        intrinsic::flip_type(mesh_, static_cast<EdgeId>(e), type)) {
      queued_[e] = 1;
      stack_.push_back(static_cast<EdgeId>(e));
    }
  }
  return empty_stack<kPtolemy>(context);
}

template <typename T>
template <bool kPtolemy>
inline bool ScalarEngine<T>::empty_stack(ExecutionContext& context) {
  const std::size_t cap = 100 * mesh_.edge_count() + 10000;
  intrinsic::FlipType type = intrinsic::FlipType::kInterior;
  std::size_t done = 0;
  while (!stack_.empty()) {
    const EdgeId e = stack_.back();
    stack_.pop_back();
    queued_[at(e)] = 0;
    if (!intrinsic::flip_type(mesh_, e, type) || !violates_delaunay(e)) continue;
    intrinsic::PlainFlips plain;
    if (!flip<kPtolemy>(e, type, plain)) return false;
    for (int i = 0; i < plain.count; ++i) {
      const EdgeId p = plain.edges[slot(i)];
      push(p);
      for (const HalfedgeId h : {2 * p, 2 * p + 1}) {
        const HalfedgeId n = mesh_.next[at(h)];
        push(n >> 1);
        push(mesh_.next[at(n)] >> 1);
      }
    }
    if (++done % kCheckFlips == 0) context.check();
    if (done > cap) return false;
  }
  return true;
}

// Flips e symmetrically: lengths, connectivity, record, shadows and stars. False, and nothing done,
// if lengths would leave the exponent range.
template <typename T>
template <bool kPtolemy>
inline bool ScalarEngine<T>::flip(EdgeId e, intrinsic::FlipType type,
                                  intrinsic::PlainFlips& plain) {
  intrinsic::FlipLengths<T> lengths(length_);
  const intrinsic::FlipStencil stencil = intrinsic::flip_stencil(mesh_, e, type);
  plain = stencil.plain;
  for (std::size_t i = 0; i < 3; ++i) {
    const EdgeId p = plain.edges[i];
    if (p != kInvalid) before_[i] = length_[at(p)];
  }
  if constexpr (kPtolemy) {
    lengths.ptolemy(stencil);
  } else {
    lengths.euclidean(stencil);
  }
  if (!usable(stencil)) {
    for (std::size_t i = 0; i < 3; ++i) {
      const EdgeId p = plain.edges[i];
      if (p != kInvalid) length_[at(p)] = before_[i];
    }
    return false;
  }
  intrinsic::flip_symmetrically(mesh_, stencil);
  flips_.push_back({type, plain});
  update_shadows(stencil);
  if (star_.empty()) return true;
  for (const EdgeId p : plain.edges) {
    if (p == kInvalid) continue;
    for (const HalfedgeId h : {2 * p, 2 * p + 1}) {
      HalfedgeId g = h;
      for (int k = 0; k < 3; ++k, g = mesh_.next[at(g)]) star_[at(mesh_.origin[at(g)])] = g;
    }
  }
  return true;
}

template <typename T>
inline bool ScalarEngine<T>::usable(const intrinsic::FlipStencil& s) const {
  for (const EdgeId e : {s.new_side, s.new_cross, s.new_diagonal, s.new_diagonal2}) {
    if (e == kInvalid) continue;
    if (!is_usable(length_[at(e)])) return false;
  }
  return true;
}

template <typename T>
inline void ScalarEngine<T>::update_shadows(const intrinsic::FlipStencil& s) {
  for (const EdgeId e :
       {s.e, s.new_side, s.new_side2, s.new_cross, s.new_diagonal, s.new_diagonal2}) {
    update_shadow(e);
  }
}

}  // namespace flipfree::conformal
