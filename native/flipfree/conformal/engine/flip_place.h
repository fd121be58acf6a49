// Where on the way of one vertex' scale factor an edge stops being Delaunay.
#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

#include "flipfree/intrinsic/delaunay_metric.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::conformal {

// The Delaunay condition of edge e while the scale factor u of v moves: low + high exp(u) >= 0 up
// to a positive factor. An edge c with the sides a, b of one of its triangles contributes
// a / b + b / a - c c / (a b), and every length grows with exp(u / 2) per end at v.
template <typename S>
struct FlipTerms {
  S low = S(0.0), high = S(0.0);
  S size = S(0.0);  // of what was added
};
template <typename S>
FlipTerms<S> flip_terms(const intrinsic::IntrinsicMesh& mesh, const std::vector<S>& length,
                        VertexId v, EdgeId e) {
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
std::optional<double> flip_place(const intrinsic::DelaunayMetric<T>& metric, VertexId v, EdgeId e,
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

}  // namespace flipfree::conformal
