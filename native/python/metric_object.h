// The dict that flipfree/conversions.py turns into its ConformalMetric.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "flipfree/conformal/metric/refined_metric.h"

namespace flipfree::python {

pybind11::object to_object(const conformal::ConformalMetric& metric);
// "auto", "on" or "off"; anything else is "auto".
conformal::StartRefinement to_start_refinement(const std::string& name);

}  // namespace flipfree::python
