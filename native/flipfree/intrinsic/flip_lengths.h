// Lengths of an intrinsic triangulation: at the start, and those that flips create, by Ptolemy's
// theorem (equation 4.6, any Penner coordinates) and in the Euclidean metric of the start. A
// symmetric flip composes them along its plain flips.
#pragma once

#include <cmath>
#include <vector>

#include "flipfree/intrinsic/intrinsic_mesh.h"
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

// Apex over a base, given the side at the base's start and the one at its end.
template <typename T>
struct Apex {
  T along;  // foot of the height, measured from the start of the base
  T height;

  Apex(const T& base, const T& at_start, const T& at_end)
      : along((base + ((at_start - at_end) / base) * (at_start + at_end)) / T(2.0)), height(0.0) {
    using std::sqrt;
    const T s = base + at_start + at_end;
    const T square = s * ((at_start - base) + at_end) * ((at_end - at_start) + base) *
                     ((at_start - at_end) + base);
    if (square > T(0.0)) height = sqrt(square) / (T(2.0) * base);
  }
  // Over half-edge h.
  Apex(const FlipMesh& mesh, const std::vector<T>& length, HalfedgeId h)
      : Apex(length[at(h >> 1)], length[at(mesh.previous(h) >> 1)],
             length[at(mesh.next_of(h) >> 1)]) {}
};

// The length that flip_edge(mesh, e) will give e in the Euclidean metric: both sides of the edge
// are unfolded into the plane. `length`: per edge.
template <typename T>
T euclidean_flip(const FlipMesh& mesh, const std::vector<T>& length, EdgeId e) {
  using std::sqrt;
  const Apex<T> k(mesh, length, 2 * e), m(length[at(e)], length[at(mesh.next_of(2 * e + 1) >> 1)],
                                          length[at(mesh.previous(2 * e + 1) >> 1)]);
  const T along = k.along - m.along, across = k.height + m.height;
  return sqrt(along * along + across * across);
}

// The same by Ptolemy's theorem. No subtraction: relative errors stay small.
template <typename T>
T ptolemy_flip(const FlipMesh& mesh, const std::vector<T>& length, EdgeId e) {
  const auto of = [&](HalfedgeId h) -> const T& { return length[at(h >> 1)]; };
  const HalfedgeId h = 2 * e, o = h + 1;
  return (of(mesh.next_of(h)) / of(h)) * of(mesh.next_of(o)) +
         (of(mesh.previous(h)) / of(h)) * of(mesh.previous(o));
}

}  // namespace flipfree::intrinsic
