// A conformal map with prescribed angles: metric -> overlay -> layout -> refinement -> certificate
// (thesis 4 whole).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/intrinsic/layout/layout.h"

namespace flipfree::conformal {

struct ConformalMapOptions {
  IndexPairs cuts;  // seam edges that the user wants; others are added only where the cones and
                    // handles need them
  IndexPairs uncuttable;  // edges that added cuts avoid: diagonals of polygons
  intrinsic::Refinement refinement = intrinsic::Refinement::kAuto;
  MetricOptions metric;        // its max_seconds are those of the whole map
  bool refined_start = false;  // metric.h
  // Where 64 bits do not hold the map: crossings of the overlay are spread by this share
  // (intrinsic/overlay.h). The map is then the metric's at the vertices only. 0:
  // never.
  double spread = 0.0;
  // The vertex positions may have no area, as the metric is not theirs; see
  // CertifyRequest::require_distortion.
  bool positions_are_metric = true;
};

// What came out. The metric is there whenever it converged, also if it cannot be stored as a map.
struct ConformalMapResult {
  ConformalMetric metric;
  certify::Parametrization map;  // certified; valid if and only if `failure` is empty
  // Per vertex of map.surface: logarithm of its weight in the projective map of thesis 4.5
  // (intrinsic::Crossing); empty for a refined start.
  std::vector<double> log_weight;
  std::optional<Error>
      failure;  // why there is no valid map: kRoundingFlips, kCertificateFailed, kIterationLimit
};

// The map of a converged metric of this surface, which may have been refined for it.
// `target_angles` as for the metric; boundary targets below zero are "free" and not certified. A
// failure to store the map is returned in `failure`, with the certificate of the best attempt in
// map.certificate; so is a limit of time that ends it (kTimeLimit). Throws InvalidInput for cuts
// that are no edges, Cancelled, InternalError.
ConformalMapResult map_from_metric(const mesh::Surface& surface,
                                   const std::vector<double>& target_angles, RefinedMetric solved,
                                   const ConformalMapOptions& options, ExecutionContext& context);

// Metric and map. `lengths`: #F x 3, the metric to start from (metric.h), or null: that of the
// vertex positions. Errors of the metric are thrown (metric.h).
ConformalMapResult conformal_map(const mesh::Surface& surface, const Points3* lengths,
                                 const std::vector<double>& target_angles,
                                 const ConformalMapOptions& options, ExecutionContext& context);

// Moves surface, UVs and provenance to `map`, with the nearest 32-bit UVs.
void take_map(intrinsic::RefinedLayout& layout, certify::Parametrization& map);

}  // namespace flipfree::conformal
