// A metric of a disk with prescribed angles, near to its own (thesis 5.2.2, 5.4.2).
//
// Deviation from the thesis: the metric need not be conformal, so it is not. Along handles and
// between far cones a conformal metric shrinks exponentially, by hundreds of orders of magnitude on
// surfaces of high genus; the nearest metric in the logarithms of edge lengths does not.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/conformal_metric.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// `angle`: per vertex, total. By the shortest steps from the disk's own metric; where these do not
// get there, the conformal one. On the double cover (conformal/metric). Errors: NotConverged,
// Cancelled.
conformal::ConformalMetric compute_disk_metric(const mesh::Surface& disk,
                                               const std::vector<double>& angle,
                                               ExecutionContext& context);

}  // namespace flipfree::seamless
