// An intrinsic triangulation with lengths of one precision that is kept Delaunay by flips (Weeks'
// algorithm, thesis 4.2.4), whatever changes the lengths in between.
//
// Delaunay tests and angles are answered from lengths rounded to double (shadows) wherever these
// are enough. Flips are recorded; lengths may be any Penner coordinates.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/delaunay_test.h"
#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {

// Which lengths a flip makes: those of the Euclidean metric, or by Ptolemy's theorem.
enum class FlipRule { kEuclidean, kPtolemy };

// How much is done per check for cancel: with the most bits a Delaunay test or a flip takes some
// 30 us, an angle or a logarithm half a millisecond.
template <typename T>
struct ChecksPer {
  static constexpr bool kIsDouble = numeric::ScalarTraits<T>::kIsDouble;
  static constexpr std::size_t kTests = kIsDouble ? 2048 : 256;
  static constexpr std::size_t kFlips = kIsDouble ? 1024 : 64;
  static constexpr std::size_t kLogarithms = kIsDouble ? 2048 : 32;
};

template <typename T>
class DelaunayMetric {
 public:
  // `lengths`: per edge, of `bits` mantissa bits, symmetric as the mesh is.
  DelaunayMetric(IntrinsicMesh mesh, std::vector<T> lengths, int bits)
      : bits_(bits), mesh_(std::move(mesh)), length_(std::move(lengths)) {
    queued_.assign(mesh_.edge_count(), 0);
    stack_.reserve(mesh_.edge_count());
  }

  const IntrinsicMesh& mesh() const { return mesh_; }
  const std::vector<T>& lengths() const { return length_; }
  const T& length(HalfedgeId h) const { return length_[at(h >> 1)]; }
  int bits() const { return bits_; }
  const std::vector<FlipRecord>& flips() const { return flips_; }
  // Delaunay tests that the filter in double left to the scalar type.
  std::size_t exact_tests() const { return exact_tests_; }
  // All lengths rounded to double, while that is known; else null.
  const std::vector<double>* rounded_lengths() const { return shadow_valid_ ? &shadow_ : nullptr; }

  // change(edge, length) for every edge.
  template <typename Change>
  void change_lengths(const Change& change) {
    for (std::size_t e = 0; e < length_.size(); ++e) change(e, length_[e]);
    shadow_valid_ = false;
  }
  // Of a double cover whose lengths in copy 1 and across the line changed: gives copy 2 those of
  // its mirror images, and the diagonals of symmetric quadrilaterals theirs.
  // A symmetric quadrilateral with parallel sides s, t and legs l is an inscribed trapezoid, so its
  // diagonal d satisfies d^2 = l^2 + s t under every symmetric metric.
  void restore_symmetry() {
    using std::sqrt;
    const auto edge_count = static_cast<EdgeId>(mesh_.edge_count());
    for (EdgeId e = 0; e < edge_count; ++e) mirror(e);
    for (EdgeId e = 0; e < edge_count; ++e) {
      if (mesh_.label_of_edge(e) != EdgeLabel::kDiagonal) continue;
      T leg(0.0), parallel[2] = {leg, leg};
      for (const HalfedgeId h : {2 * e, 2 * e + 1}) {
        for (const HalfedgeId side : {mesh_.next_of(h), mesh_.previous(h)}) {
          const bool across = mesh_.label_of_edge(side >> 1) == EdgeLabel::kPerpendicular;
          (across ? parallel[h % 2] : leg) = length(side);
        }
      }
      // As quotients: the squares may leave the exponent range.
      const T scale = std::max({parallel[0], parallel[1], leg});
      const T a = leg / scale;
      length_[at(e)] = scale * sqrt(a * a + (parallel[0] / scale) * (parallel[1] / scale));
    }
    shadow_valid_ = false;
  }

  void scale_length(EdgeId e, const T& factor) {
    length_[at(e)] *= factor;
    update_shadow(e);
  }

  // Flips until every edge is Delaunay. False if it gave up: lengths left the exponent range, or
  // the number of flips exceeded a multiple of the number of edges. With kEuclidean, a violated
  // triangle inequality (as rounding may make of needles) is read as a flat triangle.
  // Terminates: each flip strictly lowers the hyperbolic Delaunay functional (Weeks), and flips
  // happen only where the criterion is violated beyond rounding; the cap is a guard against what
  // rounding could still do.
  template <FlipRule kRule>
  bool make_delaunay(const ExecutionContext& context) {
    stack_.clear();
    round_lengths();
    for (auto e = static_cast<EdgeId>(mesh_.edge_count()); e-- > 0;) {
      if (at(e) % ChecksPer<T>::kTests == 0) context.check();
      queued_[at(e)] = violates_delaunay(e) && flip_type(mesh_, e);
      if (queued_[at(e)] != 0) stack_.push_back(e);
    }
    return empty_line<kRule>(context);
  }

  // The same from the edges in line alone, and what they drag along.
  template <FlipRule kRule>
  bool empty_line(const ExecutionContext& context) {
    const std::size_t cap = kMostFlips * mesh_.edge_count() + kFlipsAnyway;
    std::size_t done = 0;
    while (!stack_.empty()) {
      const EdgeId e = stack_.back();
      stack_.pop_back();
      queued_[at(e)] = 0;
      const std::optional<FlipType> type = flip_type(mesh_, e);
      if (!type || !violates_delaunay(e)) continue;
      const FlipRecord* flipped = flip<kRule>(e, *type);
      if (flipped == nullptr) return false;
      for (const EdgeId p : flipped->plain) {
        put_in_line(p);
        for (const HalfedgeId h : {2 * p, 2 * p + 1}) {
          const HalfedgeId n = mesh_.next[at(h)];
          put_in_line(n >> 1);
          put_in_line(mesh_.next[at(n)] >> 1);
        }
      }
      if (++done % ChecksPer<T>::kFlips == 0) context.check();
      if (done > cap) return false;
    }
    return true;
  }

  // Puts an edge, or its mirror image in copy 1, in line.
  void put_in_line(EdgeId e) {
    if (mesh_.symmetric()) {
      const EdgeLabel label = mesh_.edge_label[at(e)];
      if (label == EdgeLabel::kDiagonal) return;
      if (label == EdgeLabel::kTwo) e = mesh_.reflection[at(2 * e)] >> 1;
    }
    if (queued_[at(e)] != 0) return;
    queued_[at(e)] = 1;
    stack_.push_back(e);
  }

  void clear_line() {
    for (const EdgeId e : stack_) queued_[at(e)] = 0;
    stack_.clear();
  }

  // Flips e symmetrically: lengths, connectivity, record, rounded lengths and stars. Null, and
  // nothing done, if lengths would leave the exponent range; else its record, valid until the next.
  template <FlipRule kRule>
  const FlipRecord* flip(EdgeId e, FlipType type) {
    const FlipRecord record = flip_of(mesh_, e, type);
    const auto& edges = record.plain.edges;
    for (std::size_t i = 0; i < at(record.plain.count); ++i) {
      T& length = length_[at(edges[i])];
      before_[i] = length;
      if (i > 0 && type == FlipType::kInterior) {
        length = length_[at(edges[0])];  // of the mirror image
      } else if constexpr (kRule == FlipRule::kPtolemy) {
        length = ptolemy_flip(mesh_, length_, edges[i]);
      } else {
        length = euclidean_flip(mesh_, length_, edges[i]);
      }
      flip_edge(mesh_, edges[i]);
      if (is_usable_length(length)) continue;
      for (++i; i-- > 0;) {
        for (int turn = 0; turn < 3; ++turn)
          flip_edge(mesh_, edges[i]);  // the fourth is none at all
        length_[at(edges[i])] = before_[i];
      }
      return nullptr;
    }
    relabel(mesh_, record);
    flips_.push_back(record);
    for (const EdgeId changed : record.plain) {
      mirror(changed);
      update_shadow(changed);
    }
    for (const EdgeId p : record.plain) {
      if (star_.empty()) break;
      for (const HalfedgeId h : {2 * p, 2 * p + 1}) {
        HalfedgeId g = h;
        for (int k = 0; k < 3; ++k, g = mesh_.next[at(g)]) star_[at(mesh_.origin[at(g)])] = g;
      }
    }
    return &flips_.back();
  }

  // The half-edges of a face, and its shape. `accuracy`: error of the angles that is good enough;
  // where no x is too small for that, rounded lengths serve.
  TriangleShape shape(std::size_t f, double accuracy, HalfedgeId h[3]) const {
    h[0] = mesh_.face_halfedge[f];
    h[1] = mesh_.next[at(h[0])];
    h[2] = mesh_.next[at(h[1])];
    if constexpr (!Traits::kIsDouble) {
      if (shadow_valid_) {
        TriangleShape shape;
        perimeter_differences(shadow_[at(h[0] >> 1)], shadow_[at(h[1] >> 1)],
                              shadow_[at(h[2] >> 1)], shape.x);
        if (rounded_lengths_serve(shape.x, accuracy)) {
          shape.radius = std::sqrt(shape.x[0] * shape.x[1] * shape.x[2]);
          return shape;
        }
      }
    }
    return shape_in_full(length(h[0]), length(h[1]), length(h[2]), bits_);
  }

  // Rounds all lengths, unless some leave a safe part of the exponent range.
  void round_lengths() {
    if constexpr (!Traits::kIsDouble) {
      shadow_.resize(length_.size());
      shadow_valid_ = true;
      for (std::size_t e = 0; e < length_.size(); ++e) {
        shadow_[e] = Traits::to_double(length_[e]);
        if (!in_safe_range(shadow_[e])) {
          shadow_valid_ = false;
          return;
        }
      }
    }
  }

  // Makes around() available, kept through flips until go_back().
  void index_stars() {
    if (!star_.empty()) return;
    star_.resize(mesh_.vertex_count());
    for (std::size_t h = 0; h < mesh_.halfedge_count(); ++h)
      star_[at(mesh_.origin[h])] = static_cast<HalfedgeId>(h);
  }

  // visit(half-edge) for those out of vertex v, clockwise.
  template <typename Visit>
  void around(VertexId v, Visit visit) const {
    const HalfedgeId first = star_[at(v)];
    HalfedgeId h = first;
    do {
      visit(h);
      h = mesh_.next[at(h ^ 1)];
    } while (h != first);
  }

  // Remembers the present metric, and returns to the one remembered last. Copies all arrays.
  void remember() {
    memory_.mesh = mesh_;
    memory_.length = length_;
    memory_.flips = flips_.size();
  }
  void go_back() {
    mesh_ = memory_.mesh;
    length_ = memory_.length;
    flips_.resize(memory_.flips);
    star_.clear();
    shadow_valid_ = false;
  }

 private:
  using Traits = numeric::ScalarTraits<T>;
  // Lengths that shadows may have: products of a few stay in range.
  static constexpr double kLeastRounded = 1e-280;
  static constexpr double kMostRounded = 1e280;
  // Flips per edge, and anyway, after which rounding must be what goes round in circles.
  static constexpr std::size_t kMostFlips = 100;
  static constexpr std::size_t kFlipsAnyway = 10'000;
  bool violates_delaunay(EdgeId e) {
    const HalfedgeId h = 2 * e, o = h + 1;
    const auto decided = [&](const auto& length, const auto& test) {
      return test(length[at(e)], length[at(mesh_.next_of(h) >> 1)],
                  length[at(mesh_.previous(h) >> 1)], length[at(mesh_.next_of(o) >> 1)],
                  length[at(mesh_.previous(o) >> 1)]);
    };
    if constexpr (Traits::kIsDouble) {
      return decided(length_, delaunay_sign) < 0;
    } else {
      const int sign = shadow_valid_ ? decided(shadow_, delaunay_sign) : 0;
      if (sign != 0) return sign < 0;
      ++exact_tests_;
      return decided(length_, [&](const T& c, const T& a, const T& b, const T& a2, const T& b2) {
        return violates_delaunay_in_full(c, a, b, a2, b2, bits_);
      });
    }
  }

  void mirror(EdgeId e) {
    if (mesh_.label_of_edge(e) == EdgeLabel::kTwo)
      length_[at(e)] = length_[at(mesh_.reflection[at(2 * e)] >> 1)];
  }
  void update_shadow(EdgeId e) {
    if constexpr (!Traits::kIsDouble) {
      if (!shadow_valid_) return;
      shadow_[at(e)] = Traits::to_double(length_[at(e)]);
      if (!in_safe_range(shadow_[at(e)])) shadow_valid_ = false;
    }
  }

  static bool in_safe_range(double x) { return x > kLeastRounded && x < kMostRounded; }

  struct Memory {
    IntrinsicMesh mesh;
    std::vector<T> length;
    std::size_t flips = 0;
  };

  int bits_;
  IntrinsicMesh mesh_;
  std::vector<T> length_;
  std::array<T, 3> before_;  // lengths that a flip overwrites
  std::vector<double> shadow_;
  bool shadow_valid_ = false;
  std::vector<FlipRecord> flips_;
  std::size_t exact_tests_ = 0;
  std::vector<HalfedgeId> star_;  // per vertex: a half-edge out of it
  std::vector<char> queued_;
  std::vector<EdgeId> stack_;
  Memory memory_;
};

// The Delaunay condition of edge e while the scale factor u of v moves: low + high exp(u) >= 0 up
// to a positive factor. An edge c with the sides a, b of one of its triangles contributes
// a / b + b / a - c c / (a b), and every length grows with exp(u / 2) per end at v.
template <typename S>
struct FlipTerms {
  S low = S(0.0), high = S(0.0);
  S size = S(0.0);  // of what was added
};
template <typename S>
FlipTerms<S> flip_terms(const IntrinsicMesh& mesh, const std::vector<S>& length, VertexId v,
                        EdgeId e) {
  FlipTerms<S> terms;
  const HalfedgeId h0 = 2 * e;
  const bool from = mesh.origin[at(h0)] == v;
  const bool to = mesh.origin[at(h0 + 1)] == v;
  const S& c = length[at(e)];
  for (const HalfedgeId h : {h0, h0 + 1}) {
    const HalfedgeId n = mesh.next[at(h)];
    const HalfedgeId p = mesh.next[at(n)];
    const bool apex = mesh.origin[at(p)] == v;
    const S& a = length[at(n >> 1)];  // from h's end to the apex
    const S& b = length[at(p >> 1)];  // from the apex to h's start
    const S inverse = S(1.0) / (a * b);
    const S ab = a * a * inverse;
    const S ba = b * b * inverse;
    const S cc = c * c * inverse;
    terms.size += ab + ba + cc;
    // Times exp(u) if neither end is v, exp(u / 2) if one is.
    const bool starts = (h == h0) ? from : to;  // v is where h starts
    const bool ends = (h == h0) ? to : from;
    (starts ? terms.low : terms.high) += ab;
    (ends ? terms.low : terms.high) += ba;
    (apex ? terms.low : terms.high) -= cc;
  }
  return terms;
}

// The change of u from which on e is not Delaunay, while u falls (`shrinks`) or grows; on the other
// side of 0 where it is not Delaunay now; nothing if it never comes to that.
template <typename T>
std::optional<double> flip_place(const DelaunayMetric<T>& metric, VertexId v, EdgeId e,
                                 bool shrinks) {
  const auto place = [&](const auto& terms) -> std::optional<double> {
    const auto zero = std::decay_t<decltype(terms.low)>(0.0);
    if (!(shrinks ? terms.low < zero : terms.high < zero)) return std::nullopt;
    // No root: it never is Delaunay.
    const double never = std::numeric_limits<double>::infinity();
    if (shrinks ? !(terms.high > zero) : !(terms.low > zero))
      return shrinks ? std::log1p(1.0) : -never;
    const double slack = numeric::ratio(terms.low + terms.high, terms.high);
    return slack < 1.0 ? std::log1p(-slack) : -never;
  };
  if constexpr (!numeric::ScalarTraits<T>::kIsDouble) {
    // Share of the sum that must be left of it, for a double to say where the root is.
    constexpr double kLeft = 1e-7;
    if (const std::vector<double>* rounded = metric.rounded_lengths()) {
      const FlipTerms<double> terms = flip_terms(metric.mesh(), *rounded, v, e);
      if (std::isfinite(terms.size) && std::abs(terms.low + terms.high) > kLeft * terms.size)
        return place(terms);
    }
  }
  return place(flip_terms(metric.mesh(), metric.lengths(), v, e));
}

}  // namespace flipfree::intrinsic
