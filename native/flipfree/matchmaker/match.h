// Hard constraints (thesis 3.3): pinned vertices, lines and whole boundaries met bit for bit,
// without a fold.
//
// Four engines behind one door:
//   first_try.h     a valid map without the pins, then walk_pins.h: no guarantee;
//   walk_outline.h  a walk to an outline that winds, refining as it goes: no guarantee;
//   film_overlay.h  straight to an outline of many corners, by cutting the surface along lines;
//   pipeline.h      MatchMaker++: always succeeds (up to 64-bit resolution), refines most.
// The maps of the last two are optimised and their refinement is taken back vertex by vertex
// (coarsen.h) as far as they stay valid; MatchMaker++'s is first restricted to the user's vertices
// and untangled there.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/matchmaker/request/constraints.h"

namespace flipfree::matchmaker {

enum class MatchEngine {
  kAuto,        // first try, then MatchMaker++
  kFirstTry,    // for tests and papers: NotConverged if the first try fails
  kOutline,     // for tests and papers: straight to the walk with the outline (walk_outline.h)
  kOverlay,     // for tests and papers: straight to the outline in one step (film_overlay.h)
  kArms,        // for tests and papers: straight to an arm for every pin (arms.h)
  kMatchmaker,  // for tests and papers: straight to MatchMaker++
};

struct MatchOptions {
  bool optimise = true;  // lower the distortion with all constraints held
  bool bijective =
      false;  // with a free boundary: the map must be one-to-one as a whole, not only locally
  int max_iterations = 200;
  MatchEngine engine = MatchEngine::kAuto;
  // Of the clock; 0: no limit. The ways share them (time_share.h). Once a map meets all
  // constraints, it is returned in the end, however little time there was to make it better.
  double max_seconds = 0;
};

// surface: a disk. Guarantee: the certificate of the result holds: no flips in 64 and 32 bits (G1),
// corners wind once (G2), constraints are met bit for bit in 64 bits and, rounded, in 32 (G3), the
// mesh subdivides the input (G7). Throws InvalidInput, Infeasible (see constraints.h,
// build_target.h), NotConverged (kTimeLimit: no map was found in max_seconds), Cancelled. Stats:
// "engine" ("first try", "outline", "overlay", "matchmaker, restricted", "matchmaker, coarsened"),
// "added_vertices", "energy", "seconds_*", "first_try.*", "matchmaker.*", "distortion.*",
// "rounding.*", "time_limit_reached" (1: the map might have become better, or have fewer vertices,
// with more time). Deterministic for any number of threads as long as no limit of time is reached.
certify::Parametrization match(const mesh::Surface& surface, const MatchRequest& request,
                               const MatchOptions& options, ExecutionContext& context);

// What is said when time was over before there was a map. Throws NotConverged (kTimeLimit).
[[noreturn]] void throw_match_out_of_time(const MatchOptions& options);

}  // namespace flipfree::matchmaker
