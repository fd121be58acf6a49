// Discretely conformally equivalent metric with prescribed angles (thesis 4.2-4.4, Algorithm 3).
//
// Guarantee: the metric (mesh, length) that comes back is intrinsically Delaunay and has at every
// vertex the prescribed total angle up to `angle_error` (measured on the returned lengths in the
// precision of the run, at most the tolerance); it is discretely conformally equivalent to the
// input in the sense of Definition 4.2: `flips` leads from the input triangulation through Delaunay
// ones to the final one.
#pragma once

#include <cstdint>
#include <functional>
#include <variant>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/conformal/added_vertex.h"
#include "flipfree/conformal/symmetric_flips.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/big_float.h"

namespace flipfree::conformal {

// Numbers in the precision of a run: plain doubles, or MPFR numbers of up to 256, 1024 or 4096
// bits. Use std::visit.
using Scalars = std::variant<std::vector<double>, std::vector<BigFloat<4>>,
                             std::vector<BigFloat<16>>, std::vector<BigFloat<64>>>;

// How the triangulation changed, in order. Euclidean flips (intrinsic flips of the initial
// Euclidean metric, thesis "MakeDelaunay") come first: their number is
// ConformalMetric::euclidean_flips. All later ones are Ptolemy flips.
struct FlipRecord {
  FlipType type = FlipType::kInterior;
  PlainFlips
      plain;  // apply flip_edge to these edges in order, starting from ConformalMetric::initial
};

struct MetricOptions {
  double tolerance = 1e-10;  // of every vertex' total angle, radians
  int bits =
      0;  // mantissa: 0 = auto (double, then only as many as needed); 53 = double; up to 4096
  int max_iterations = 500;  // Newton steps, all precisions together
  double max_seconds = 0.0;  // give up after so many seconds of wall time; 0 = never
  // Asked once when max_seconds are over: how many more there are. Null: none.
  std::function<double()> more_seconds = {};
  bool require_convergence =
      true;  // throw NotConverged; else return what was reached, converged = false
};

struct ConformalMetric {
  // The input triangulation (or its double cover), half-edge of every input corner, its Euclidean
  // edge lengths.
  IntrinsicMesh initial;
  std::vector<HalfedgeId> input_halfedge;  // 3 #F
  std::vector<bool> on_boundary;           // per input vertex
  Scalars initial_length;                  // per edge of `initial`

  std::vector<FlipRecord> flips;
  std::size_t euclidean_flips = 0;  // the first so many of `flips` kept the Euclidean metric

  // The result. Final length of edge (i, j) = Penner length of the replayed flips * exp((u_i + u_j)
  // / 2).
  IntrinsicMesh mesh;
  Scalars length;                     // per edge of `mesh`, in the new metric
  Scalars u;                          // per input vertex: logarithmic scale factors, mean 0
  std::vector<double> scale_factors;  // u, rounded
  std::vector<double> angles;         // per input vertex: total angle reached
  double angle_error = 0.0;           // max |angles - target|, before rounding
  double scale_range = 0.0;           // max u - min u
  int bits = 53;
  int iterations = 0;
  std::vector<double> error_history;  // max angle error at the start and after every Newton step
  std::array<std::size_t, kFlipTypes> flip_counts{};  // Ptolemy flips in `flips` by type
  bool converged = false;
  // Of a refined surface (refined_metric.h): where its last vertices lie on the user's. Everything
  // "per input vertex" above includes them then, and `initial` is the refined triangulation.
  std::vector<AddedVertex> added;
  Stats stats;
};

// `target_angles`: per vertex the total angle, interior 2 pi - curvature, boundary pi - geodesic
// curvature. Errors: InvalidInput (mesh not valid, connected and free of isolated vertices; angles
// not positive or not finite), Infeasible/kGaussBonnet (names the remainder), NotConverged (says
// what was reached), Cancelled.
ConformalMetric compute_conformal_metric(const Surface& surface,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context);
// The same for given lengths: lengths(f, k) belongs to the edge from corner k to k + 1 of face f;
// both sides of an edge must agree and every face must satisfy the strict triangle inequality.
ConformalMetric compute_conformal_metric(Index vertex_count, const Triangles& faces,
                                         const Points3& lengths,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context);

// The checks that both do first; `lengths` may be null. Throws as they do.
void validate_metric_input(const Surface& surface, const Points3* lengths,
                           const std::vector<double>& target_angles, const MetricOptions& options);
// NotConverged, saying what a metric that did not converge reached.
[[noreturn]] void throw_not_reached(const ConformalMetric& metric, const MetricOptions& options);

}  // namespace flipfree::conformal
