// What the search for a discretely conformally equivalent metric found (metric.h).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/symmetric_flips.h"

namespace flipfree::conformal {

// How a search for a metric ended.
enum class NewtonEnd {
  kConverged,
  kPrecision,  // rounding decides from here on: go on with more bits
  kIterations,
  kSeconds,
};
// For people: tolerance, precision, iterations, seconds.
inline const char* name_of(NewtonEnd end) {
  switch (end) {
    case NewtonEnd::kConverged:
      return "tolerance";
    case NewtonEnd::kPrecision:
      return "precision";
    case NewtonEnd::kIterations:
      return "iterations";
    case NewtonEnd::kSeconds:
      return "seconds";
  }
  return "";
}

// Per input vertex: with those of a refined start, if there was one (FlippedMetric::added).
struct ConformalMetric : intrinsic::FlippedMetric {
  // `length` of edge (i, j) = Penner length of the replayed flips * exp((u_i + u_j) / 2); u has
  // mean 0.
  std::vector<double> scale_factors;  // u, rounded
  std::vector<double> angles;         // per input vertex: total angle reached
  double angle_error = 0.0;           // max |angles - target|, before rounding
  double scale_range = 0.0;           // max u - min u
  int bits = 53;
  int iterations = 0;
  std::vector<double> error_history;  // max angle error at the start and after every Newton step
  std::array<std::size_t, intrinsic::kFlipTypes> flip_counts{};  // Ptolemy flips in `flips` by type
  bool converged = false;
  NewtonEnd end = NewtonEnd::kIterations;
  Stats stats;
};

}  // namespace flipfree::conformal
