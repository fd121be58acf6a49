// A flat metric with prescribed cone angles and loop angles, all in quarter turns: the metric of a
// seamless map (Capouellez, Zorin 2024; design: Penner coordinates without the chain rule).
//
// Starts from the discretely conformal metric with the same cones, so that only the loops are left;
// then Newton's method (penner_newton.h), for other turns where that stalls, and relaxation
// (relaxation.h) where the scale spans much. The overlay of the input with the final triangulation
// is what the flips lead to: the metric changes between them in any way, isotopy classes do not
// care.
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/bordered/corners.h"
#include "flipfree/seamless/bordered/loop_turns.h"

namespace flipfree::seamless {

struct PennerOptions {
  Boundary boundary = Boundary::kAligned;
  int max_iterations = 200;  // Newton steps for one choice of turns, conformal start not counted
};

struct PennerMetric {
  std::vector<double> angles;  // per vertex, that were asked for
  // The metric, its triangulation and the flips that lead there (Euclidean and Ptolemy flips of the
  // conformal start, then Ptolemy flips of this one). `u`: the conformal part of the change.
  conformal::ConformalMetric metric;
  std::vector<LoopTurn> loops;  // on the input
  double seconds_conformal = 0.0, seconds_newton = 0.0;
  int iterations = 0;  // of Newton's method
  int relaxed = 0;     // steps of relaxation
};

// `cones`: quarter turns per vertex, 4 where it is flat; at the boundary as aligned_cones() returns
// them, or kNotGiven where it is free. `loops`: none: a homology basis with the turns that the
// conformal metric is nearest to and that some metric has. Given ones must generate the homology
// and be independent there. With a boundary: of the surface with every curve of it contracted, 2 g;
// to these come, where it is aligned, strips from the first curve to the others.
// Precondition: a valid, connected surface. Errors: signature.h, bordered/corners.h; InvalidInput
// (loops of the wrong number, or that are no closed strips), NotConverged (says
// what was reached), Cancelled.
PennerMetric compute_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   const std::optional<std::vector<LoopTurn>>& loops,
                                   const PennerOptions& options, ExecutionContext& context);

// The same from another metric of this closed surface with these cones, whose loops turn by quarter
// turns already, all but for its errors: what these leave is met by Newton's method, then relaxed.
PennerMetric finish_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                  conformal::ConformalMetric start, const PennerOptions& options,
                                  ExecutionContext& context);

}  // namespace flipfree::seamless
