// Field-Aligned Seamless Map: a map with exactly the topology of a cross field, that follows it
// (thesis 6; design: G1, G2, G4, G5, G6, G7).
//
//   signature_of()         field/topology/turning.h        what the map must have
//   compute_penner_map()   seamless/penner/penner.h        a map that has it
//   align()                distortion/alignment/align.h    brought to follow the field
//   finish_map()           seamless/exact/seamless_map.h   exact seams, certificate
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/field/topology/cross_field.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/exact/seamless_map.h"

namespace flipfree::holonomy {

struct AlignedOptions {
  seamless::PennerMapOptions engine;  // its own max_seconds are not looked at
  bool optimise = true;               // follow the field; else the engine's map, turned to it
  bool exact = true;                  // false: seams match up to rounding only
  std::vector<double> sizing;         // #V: length in the map of a length 1 there, relative to the
                                      // others, positive; empty: all alike
  int max_iterations = 100;           // of the alignment
  double max_seconds = 0.0;           // of the clock; 0: no limit
};

// Closed surface, any number of components. Result: certified; G6 on a homology basis of the
// refined surface, with the turning numbers that the field has along it. Stats: those of the engine
// and of align(), "angle_mean" and "angle_p95" (distortion::angles_off() by area, radians),
// "loops_checked". Throws InvalidInput (defects; a boundary; sizing), Infeasible (signatures that
// no map has), NotConverged, Cancelled.
certify::Parametrization compute_field_aligned_map(const mesh::Surface& surface,
                                                   const field::CrossField& field,
                                                   const AlignedOptions& options,
                                                   ExecutionContext& context);

}  // namespace flipfree::holonomy
