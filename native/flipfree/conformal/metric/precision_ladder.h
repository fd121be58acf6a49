// Newton's method in double, and from where rounding decides, with ever more bits.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/metric/metric_input.h"

namespace flipfree::conformal {

// `input`: with targets. Errors: NotConverged as compute_conformal_metric(), Cancelled.
ConformalMetric climb_precision_ladder(const EngineInput& input, const MetricOptions& options,
                                       ExecutionContext& context);

// NotConverged, saying what a metric that did not converge reached.
[[noreturn]] void throw_not_reached(const ConformalMetric& metric, const MetricOptions& options);

}  // namespace flipfree::conformal
