// Discretely conformally equivalent metric with prescribed angles (thesis 4.2-4.4, Algorithm 3).
//
// Guarantee: the metric (mesh, length) that comes back is intrinsically Delaunay and has at every
// vertex the prescribed total angle up to `angle_error` (measured on the returned lengths in the
// precision of the run, at most the tolerance); it is discretely conformally equivalent to the
// input in the sense of Definition 4.2: `flips` leads from the input triangulation through Delaunay
// ones to the final one.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/conformal_metric.h"
#include "flipfree/conformal/metric/metric_input.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::conformal {

// `target_angles`: per vertex the total angle, interior 2 pi - curvature, boundary pi - geodesic
// curvature. Errors: InvalidInput (mesh not valid, connected and free of isolated vertices; angles
// not positive or not finite), Infeasible/kGaussBonnet (names the remainder), NotConverged (says
// what was reached), Cancelled.
ConformalMetric compute_conformal_metric(const mesh::Surface& surface,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context);
// The same for given lengths: lengths(f, k) belongs to the edge from corner k to k + 1 of face f;
// both sides of an edge must agree and every face must satisfy the strict triangle inequality.
ConformalMetric compute_conformal_metric(Index vertex_count, const Triangles& faces,
                                         const Points3& lengths,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context);

// Either: `lengths` may be null.
ConformalMetric compute_conformal_metric(const mesh::Surface& surface, const Points3* lengths,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context);

// The checks that all do first; `lengths` may be null. Throws as they do.
void validate_metric_input(const mesh::Surface& surface, const Points3* lengths,
                           const std::vector<double>& target_angles, const MetricOptions& options);
}  // namespace flipfree::conformal
