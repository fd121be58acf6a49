// Seamless Map: cones in quarter turns -> a map whose seams match exactly as stored (thesis 5;
// design: G1, G2, G4, G5, G7).
//
//   compute_penner_map()   penner/penner.h           a map whose seams match up to rounding
//   make_exact()           distortion/seams/seams.h  less distortion, then exact seams
//   certify_map()          certify/certified_map.h   decides on the stored values
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/penner/penner.h"

namespace flipfree::seamless {

struct SeamlessOptions {
  PennerMapOptions engine;   // its own max_seconds are not looked at
  bool optimise = true;      // the distortion, under the seams' constraints
  int max_iterations = 200;  // of the optimiser
  double max_seconds = 0.0;  // of the clock; 0: no limit. What is optimised by then is taken
};

// Closed surface of any genus, any number of components; `cones`: quarter turns per vertex, 4 where
// it is flat. Result: certified with G4, cut_edges along the seams' branches with their exact
// transitions; refined where the layout of the metric needs it. Stats: those of the engine and of
// make_exact(). Throws InvalidInput (defects; a boundary; cones), Infeasible (signature.h),
// NotConverged, Cancelled.
certify::Parametrization compute_seamless_map(const mesh::Surface& surface,
                                              const std::vector<Index>& cones,
                                              const SeamlessOptions& options,
                                              ExecutionContext& context);

}  // namespace flipfree::seamless
