// Why a conformal map cannot be used, in words: the place, the reason, the cure.
#pragma once

#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/certificate.h"
#include "flipfree/conformal/metric/metric.h"

namespace flipfree::conformal {

// Three significant digits.
std::string scientific(double x);

// These input faces (at least one) are too small in the map for 32-bit values.
Error not_storable(const ConformalMetric& metric, const std::vector<FaceId>& faces);
// The certificate has failures.
Error not_certified(const ConformalMetric& metric, const certify::Certificate& certificate);
// The metric was there, but time was over before its map was.
Error out_of_time(const ConformalMetric& metric);
// These input faces (at least one) need added points, which the caller did not allow.
Error needs_refinement(const std::vector<FaceId>& faces);

}  // namespace flipfree::conformal
