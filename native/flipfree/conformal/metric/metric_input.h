// What the search for a metric starts from, checked: the words for everything that is wrong with a
// mesh, lengths, options or target angles.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "flipfree/conformal/engine/engine.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::conformal {

inline constexpr int kLargestBits = 4096;

struct MetricOptions {
  double tolerance = 1e-10;  // of every vertex' total angle, radians
  int bits =
      0;  // mantissa: 0 = auto (double, then only as many as needed); 53 = double; up to 4096
  int max_iterations = 500;  // Newton steps, all precisions together
  double max_seconds = 0.0;  // give up after so many seconds of wall time; 0 = never
  // Asked once when max_seconds are over: how many more there are. Null: none.
  std::function<double()> more_seconds = {};
  bool require_convergence =
      true;  // throw NotConverged; else return what was reached, converged = false
};

// Six significant digits.
std::string short_text(double value);

// The engine's input without targets. `lengths`: #F x 3 (metric.h), or null: those of the vertex
// positions. Throws InvalidInput as compute_conformal_metric(). With lengths the positions are not
// read.
EngineInput checked_input(const mesh::Surface& surface, const Points3* lengths,
                          const MetricOptions& options);

// Positive, finite, one per vertex, and meeting Gauss-Bonnet: the angles of #F triangles sum to pi
// #F. What rounding leaves of the remainder is spread evenly. Returns the targets to solve for.
std::vector<double> checked_targets(const std::vector<double>& target, const EngineInput& input,
                                    double tolerance);

}  // namespace flipfree::conformal
