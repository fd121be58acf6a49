// The dict that flipfree/conformal.py turns into its ConformalMetric.
#pragma once

#include <pybind11/pybind11.h>

#include "flipfree/conformal/metric.h"

namespace flipfree::python {

pybind11::object to_object(const conformal::ConformalMetric& metric);

}  // namespace flipfree::python
