// Seamless Map: cones in quarter turns -> a map whose seams match exactly as stored (thesis 5;
// design: G1, G2, G4, G5, G7).
//
//   check_request()        seamless/request.h        refuses what no map can have
//   compute_penner_map()   penner/penner.h           a map whose seams match up to rounding; or
//   compute_padding_map()  padding/padding.h         where that finds none
//   turn_along_edges()     seamless_map.cpp          which way up
//   take_back()            exact/take_back.h         fewer added vertices, or none
//   make_exact()           distortion/seams/seams.h  less distortion, then exact seams
//   spread_charts()        exact/parts.h             connected parts beside each other
//   certify_map()          certify/certified_map.h   decides on the stored values
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/penner/penner.h"

namespace flipfree::seamless {

// Which engine finds the map: kAuto takes the first that does.
enum class Engine {
  kAuto,
  kPenner,   // penner/penner.h
  kPadding,  // padding/padding.h       : closed surfaces, loops as they come
};

// The map of the engine that is asked for, or of the first that finds one; `open`: is there a
// boundary, which the engine "padding" knows nothing of? Throws InvalidInput (kBadOption) if that
// engine is asked for all the same; where both find none, what the engine "penner" says.
PennerMap by_engine(Engine which, bool open, const std::function<PennerMap()>& penner,
                    const std::function<PennerMap()>& padding);

struct SeamlessOptions {
  Engine which = Engine::kAuto;
  Boundary boundary = Boundary::kAligned;
  PennerOptions engine;  // its own boundary is not looked at
  // Of finish_map() alone: edges of the engine's map inside the surface that run along the axes up
  // to rounding, and are kept there.
  std::vector<distortion::StraightEdge> straight;
  // Of finish_map() alone: edges of the input, for the certificate to say which are isolines.
  IndexPairs features;
  bool optimise = true;          // the distortion, under the seams' constraints
  bool exact = true;             // false: seams match up to rounding only; G4 is not asked for
  int max_iterations = 200;      // of the optimiser
  double suggested_bound = 2.0;  // of the scale, for cones that are suggested
  double max_seconds = 0.0;      // of the clock; 0: no limit. What is optimised by then is taken
};

// Any genus, any number of components; `cones`: quarter turns per vertex, 4 or kNotGiven where
// it is flat. At boundary vertices 2 is straight, kNotGiven what nobody asks for; boundaries are
// aligned, exactly along the axes, with corners in quarter turns that are chosen if none is given
// (request.h), or free; kAlignedOrFree: free on connected parts that find no map with an
// aligned one and have no corners given, counted in "freed_boundaries". What an aligned boundary
// would flatten is divided (parts.h), counted in "divided_chords". Result: certified with
// G4, cut_edges with their exact transitions; refined where the layout of
// the metric needs it. Connected parts are one chart each, all at the scale of the surface, in rows
// around the origin; but parts that no grid of 32-bit values holds at that scale, or where it finds
// no map, are enlarged (parts.h), counted in "enlarged_islands". Stats: those of the
// engine and of make_exact(), "engine", "engine.added_vertices", and "energy.engine" and
// "energy.optimised". Throws InvalidInput and Infeasible (request.h), NotConverged,
// Cancelled.
certify::Parametrization compute_seamless_map(const mesh::Surface& surface,
                                              const std::vector<Index>& cones,
                                              const SeamlessOptions& options,
                                              ExecutionContext& context);

// The same with the cones of suggested_turns(): every cone a whole number of quarter turns, on
// every connected part.
certify::Parametrization map_with_suggested_cones(const mesh::Surface& surface,
                                                  const SeamlessOptions& options,
                                                  ExecutionContext& context);

// Closed strips of faces of a map, and the quarter turns that it must make along them (G6;
// certify::CertifyRequest).
using Strips = std::vector<std::pair<std::vector<HalfedgeId>, Index>>;

// An engine's map, valid in 64 bits, as it is stored: optimised and exact as the options say,
// certified, with transitions. The second half of compute_seamless_map().
certify::Parametrization finish_map(PennerMap found, const mesh::Surface& surface,
                                    const Strips& strips, const SeamlessOptions& options,
                                    ExecutionContext& context);

}  // namespace flipfree::seamless
