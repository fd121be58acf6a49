#include <cmath>
#include <numbers>
#include <utility>
#include <variant>

#include "faults/calls.h"
#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/conformal/map.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/conformal/suggest_cones.h"
#include "support/shapes.h"

namespace flipfree::test {
namespace {

constexpr double kPi = std::numbers::pi;

void require_finite(const std::vector<double>& values) {
  for (const double value : values)
    if (!std::isfinite(value)) throw WrongResult("a figure came back that is not finite");
}

// A converged metric has finite scales, and the angles that were asked for.
std::string bytes_of_valid_metric(const conformal::ConformalMetric& metric,
                                  const std::vector<double>& target, double tolerance) {
  if (!metric.converged) throw WrongResult("a metric came back that did not converge");
  require_finite(metric.scale_factors);
  require_finite(metric.angles);
  for (std::size_t v = 0; v < target.size(); ++v) {
    if (!(std::abs(metric.angles[v] - target[v]) <= tolerance + 1e-12))
      throw WrongResult("a metric came back with other angles than asked for");
  }
  std::string bytes;
  append(bytes, metric.scale_factors);
  append(bytes, metric.angles);
  append(bytes, metric.mesh.next);
  return bytes;
}

// Four cones of pi on a closed surface of genus 0.
std::vector<double> four_cones(const mesh::Surface& surface) {
  std::vector<double> angles(static_cast<std::size_t>(surface.vertices.rows()), 2 * kPi);
  for (const std::size_t v : {0U, 4U, 10U, 17U}) angles[v] = kPi;
  return angles;
}

Call metric_call(std::string name, const mesh::Surface& surface, int bits) {
  return {std::move(name), [=](ExecutionContext& context, double max_seconds) {
            conformal::MetricOptions options;
            options.bits = bits;
            options.max_seconds = max_seconds;
            if (bits > 53) options.tolerance = 1e-20;
            const std::vector<double> target = four_cones(surface);
            return bytes_of_valid_metric(
                conformal::compute_conformal_metric(surface, target, options, context), target,
                options.tolerance);
          }};
}

Call conformal_call(std::string name, const mesh::Surface& surface,
                    const std::vector<double>& target) {
  return {std::move(name), [=](ExecutionContext& context, double max_seconds) {
            conformal::ConformalMapOptions options;
            options.metric.max_seconds = max_seconds;
            const conformal::ConformalMapResult result =
                conformal::conformal_map(surface, nullptr, target, options, context);
            if (result.failure) throw NotConverged(*result.failure);
            return bytes_of_valid(result.map, surface);
          }};
}

Call angles_call(std::string name, const mesh::Surface& surface, conformal::BoundaryGoal shape) {
  return {std::move(name), [=](ExecutionContext& context, double max_seconds) {
            conformal::BoundaryAnglesOptions options;
            options.boundary = shape;
            options.max_seconds = max_seconds;
            const std::vector<double> angles =
                conformal::boundary_angles(surface, options, context);
            require_finite(angles);
            std::string bytes;
            append(bytes, angles);
            return bytes;
          }};
}

Call cones_call(std::string name, const mesh::Surface& surface, double quantum) {
  return {std::move(name), [=](ExecutionContext& context, double max_seconds) {
            conformal::SuggestConesOptions options;
            options.bound = 3.0;
            options.quantum = quantum;
            options.max_seconds = max_seconds;
            const conformal::SuggestedCones cones =
                conformal::suggest_cones(surface, options, context);
            require_finite(cones.target_angles);
            if (!std::isfinite(cones.scale_ratio) ||
                (cones.bound_holds && cones.scale_ratio > options.bound))
              throw WrongResult("suggested cones do not hold their bound");
            std::string bytes;
            append(bytes, cones.target_angles);
            append(bytes, cones.cones);
            return bytes;
          }};
}

}  // namespace

std::vector<Call> conformal_calls() {
  const mesh::Surface ball = sphere(6, 5);
  const mesh::Surface bumps = bumpy_grid(4, 4, 0.5, 3);
  ExecutionContext context;
  const std::vector<double> flat = conformal::boundary_angles(bumps, {}, context);
  return {metric_call("metric", ball, 0),
          metric_call("metric, 113 bits", ball, 113),
          conformal_call("conformal", ball, four_cones(ball)),
          conformal_call("conformal, disk", bumps, flat),
          angles_call("angles, free", bumps, conformal::BoundaryGoal::kFree),
          angles_call("angles, circle", bumps, conformal::BoundaryGoal::kCircle),
          cones_call("cones", bumpy_grid(6, 6, 1.0, 2), 0.0),
          cones_call("cones, quarters", bumpy_grid(6, 6, 1.0, 2), kPi / 2)};
}

}  // namespace flipfree::test
