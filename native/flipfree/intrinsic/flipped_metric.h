// A metric on a surface that was reached from its Euclidean one by flips and changes of lengths:
// what an overlay and a layout are made of, whoever found the metric.
#pragma once

#include <cstddef>
#include <variant>
#include <vector>

#include "flipfree/intrinsic/added_vertex.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/intrinsic/symmetric_flips.h"
#include "flipfree/numeric/big_float.h"

namespace flipfree::intrinsic {

// Numbers in the precision of a run: plain doubles, or MPFR numbers of up to 256, 1024 or 4096
// bits. Use std::visit.
using Scalars =
    std::variant<std::vector<double>, std::vector<numeric::BigFloat<4>>,
                 std::vector<numeric::BigFloat<16>>, std::vector<numeric::BigFloat<64>>>;

// How the triangulation changed, in order. Euclidean flips (intrinsic flips of the initial
// Euclidean metric, thesis "MakeDelaunay") come first: their number is
// FlippedMetric::euclidean_flips. All later ones are Ptolemy flips.
struct FlipRecord {
  FlipType type = FlipType::kInterior;
  PlainFlips plain;  // apply flip_edge to these edges in order, from FlippedMetric::initial on
};

struct FlippedMetric {
  // The input triangulation (or its double cover), half-edge of every input corner, its Euclidean
  // edge lengths.
  IntrinsicMesh initial;
  std::vector<HalfedgeId> input_halfedge;  // 3 #F
  std::vector<bool> on_boundary;           // per input vertex
  Scalars initial_length;                  // per edge of `initial`

  std::vector<FlipRecord> flips;
  std::size_t euclidean_flips = 0;  // the first so many of `flips` kept the Euclidean metric

  IntrinsicMesh mesh;
  Scalars length;  // per edge of `mesh`, in the new metric
  // Of a refined surface (split_surface.h): where its last vertices lie on the user's. Everything
  // "per input vertex" above includes them then, and `initial` is the refined triangulation.
  std::vector<AddedVertex> added;
};

}  // namespace flipfree::intrinsic
