// The dict that flipfree/conversions.py turns into its ConformalMetric.
#pragma once

#include <pybind11/pybind11.h>

#include "flipfree/conformal/refined_metric.h"
#include "options.h"

namespace flipfree::python {

pybind11::object to_object(const conformal::ConformalMetric& metric);
void read_metric(OptionReader& read, conformal::MetricOptions& options);
void read_start_refinement(OptionReader& read, conformal::StartRefinement& refinement);

}  // namespace flipfree::python
