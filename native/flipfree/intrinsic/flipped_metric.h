// A metric on a surface that was reached from its Euclidean one by flips and changes of lengths:
// what an overlay and a layout are made of, whoever found the metric.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/intrinsic/symmetric_flips.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {

// Is it a length that can be worked with?
template <typename T>
bool is_usable_length(const T& x) {
  return numeric::ScalarTraits<T>::finite(x) && x > T(0.0);
}

// Numbers in the precision of a run: plain doubles, or MPFR numbers of up to 256, 1024 or 4096
// bits. Use std::visit.
using Scalars = Variant<std::vector<double>, std::vector<numeric::BigFloat<4>>,
                        std::vector<numeric::BigFloat<16>>, std::vector<numeric::BigFloat<64>>>;

// Rounded to double, and to 80-bit numbers, which have the range that lengths may need.
std::vector<double> to_doubles(const Scalars& values);
std::vector<long double> widened(const Scalars& values);
// Whether all are positive and in the range of numbers, which few bits may leave.
bool are_lengths(const Scalars& values);

struct FlippedMetric {
  // The input triangulation (or its double cover), half-edge of every input corner, its Euclidean
  // edge lengths.
  IntrinsicMesh initial;
  std::vector<HalfedgeId> input_halfedge;  // 3 #F
  std::vector<bool> on_boundary;           // per input vertex
  Scalars initial_length;                  // per edge of `initial`

  // How the triangulation changed, in order. Euclidean flips (intrinsic flips of the initial
  // Euclidean metric, thesis "MakeDelaunay") come first; all later ones are Ptolemy flips.
  std::vector<FlipRecord> flips;
  std::size_t euclidean_flips = 0;

  IntrinsicMesh mesh;
  Scalars length;  // per edge of `mesh`, in the new metric
  // Per input vertex: logarithmic scale factors, by which the map from the input to `mesh` is
  // projective along edges (thesis 4.5); of a metric that is not conformally equivalent to the
  // input, the conformal part of its change.
  Scalars u;
  // Of a refined surface (split_surface.h): where its last vertices lie on the user's. Everything
  // "per input vertex" above includes them then, and `initial` is the refined triangulation.
  std::vector<mesh::SurfacePoint> added;
};

// visit(edge) for the plain flips of the records [from, to), in order; checks for cancel.
template <typename Visit>
void replay_flips(const std::vector<FlipRecord>& flips, std::size_t from, std::size_t to,
                  const ExecutionContext& context, const Visit& visit) {
  constexpr std::size_t kFlipsPerCheck = 65536;
  for (std::size_t i = from; i < to; ++i) {
    if (i % kFlipsPerCheck == kFlipsPerCheck - 1) context.check();
    for (const EdgeId e : flips[i].plain) visit(e);
  }
}

// Empty if the parts fit together: both meshes, one length per edge, all usable, one half-edge per
// corner, flips that lead from one mesh to the other. Otherwise what is broken. Cost: O(#F +
// flips).
std::string find_broken_invariant(const FlippedMetric& metric);

}  // namespace flipfree::intrinsic
