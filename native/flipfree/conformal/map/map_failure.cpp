#include "flipfree/conformal/map/map_failure.h"
#include "flipfree/base/failure/elements.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace flipfree::conformal {
namespace {

// `what` is wrong with the map of a metric that is there.
std::string only_the_metric(const ConformalMetric& metric, const std::string& what) {
  return "The metric is computed (largest angle error " + scientific(metric.angle_error) +
         "), but its scale factors span a factor of " + scientific(std::exp(metric.scale_range)) +
         ", " + what +
         ". Spread the curvature over more cones (suggest_cones), add cuts, or use the metric as "
         "it is.";
}

}  // namespace

std::string scientific(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

Error not_storable(const ConformalMetric& metric, const std::vector<FaceId>& faces) {
  Error error;
  error.code = ErrorCode::kRoundingFlips;
  error.kind = ElementKind::kFace;
  error.elements = first_elements(faces);
  error.message = only_the_metric(
      metric, "so " + std::to_string(faces.size()) +
                  " input faces are too small in the map for 32-bit UVs, first face " +
                  std::to_string(faces[0]));
  return error;
}

Error not_certified(const ConformalMetric& metric, const certify::Certificate& certificate) {
  return {ErrorCode::kCertificateFailed,
          only_the_metric(
              metric, "and the map did not pass its certificate: " + certificate.failures.front()),
          ElementKind::kFace, certificate.failed_faces};
}

Error out_of_time(const ConformalMetric& metric) {
  return {ErrorCode::kTimeLimit,
          "The metric is computed (largest angle error " + scientific(metric.angle_error) +
              "), but time was over before its map was laid out. Allow more time (max_seconds), or "
              "use the metric as it is.",
          ElementKind::kNone,
          {}};
}

Error needs_refinement(const std::vector<FaceId>& faces) {
  Error error;
  error.code = ErrorCode::kCertificateFailed;
  error.kind = ElementKind::kFace;
  error.elements = first_elements(faces);
  error.message = "On the original triangles " + std::to_string(faces.size()) +
                  " faces would flip, first face " + std::to_string(faces[0]) +
                  ". Allow points to be added (original_triangles=\"auto\").";
  return error;
}

}  // namespace flipfree::conformal
