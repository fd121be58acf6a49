// From a seamless map in floating point to the one that is stored: optimised under its seam
// constraints, then exact (design: G4).
//
//   eliminate_seams()      which coordinates are free                  constraints.h
//   descend(), SeamSystem  less distortion in the free coordinates     seam_system.h
//   round_to_grid()        exact transitions in 64 and in 32 bits
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion {

struct ExactOptions {
  bool optimise = true;
  // The optimisation leaves some of the time that the context has for rounding (context.h), which
  // comes after it in any case.
  int max_iterations = 200;
  bool exact = true;  // false: no grid; seams match up to rounding, as they did before
};

struct ExactMap {
  Points2 uv;       // #V x 2 of the cut surface
  Points2f uv32;    // the same numbers; without a grid: rounded ones
  double step = 0;  // all coordinates are multiples, a power of two; 0 without a grid
  Stats stats;
};

// Precondition: every triangle is positively oriented by the exact test (else InvalidInput
// kFlippedMap), and the map meets its seams' quarter turns up to rounding: what it misses them by
// is what optimisation and rounding change in addition. Guarantee: flip-free, and every seam edge
// exact, in 64 and in 32 bits; edges of a branch share one translation. Optimised, the map is in
// the surface's own unit (best global scale 1), centred; else as large as it was, centred. stats:
// "distortion.*" (minimize.h), "rounding.repaired", "rounding.folded" (triangles that plain
// rounding folds), "time_limit_reached". Throws InvalidInput, NotConverged (kRoundingFlips,
// kFactorizationFailed), TimeIsOver if the context's time ends before or while the map is rounded,
// Cancelled. Cost: that of the optimisation.
ExactMap make_exact(const CutMap& map, const ExactOptions& options, ExecutionContext& context);

// The optimisation alone: so many steps. Precondition as make_exact(). Throws InvalidInput,
// NotConverged, TimeIsOver, Cancelled.
Minimized less_distorted(const CutMap& map, int max_iterations, ExecutionContext& context);

// A map that flips at most `most` triangles with these opened, if moving vertices on a grid of 24
// bits can do it; it meets its seams as before. How often it winds around a vertex
// is for the caller to check.
std::optional<Points2> opened_on_grid(const CutMap& map, std::size_t most,
                                      ExecutionContext& context);

// The UVs of the cut surface's corners.
Points2 corners_of(const CutMap& map, const Points2& uv);

// A seamless map brought to other translations across its seams, without a flip.

// The map on a grid (#V x 2 of the cut surface) whose translations, lines and cones are those of
// `goal` rounded to whole numbers, as are the places there of the vertices marked in `held` (#V);
// one of each component that moves with no translation is. All others move as little as goes with
// it, by the symmetric Dirichlet energy of the change of shape. `goal` (#V x 2) meets the seams'
// quarter turns; where it flips no triangle, the way begins there, else it begins at the map, and
// translations are moved as far as steps without flips go. nullopt if they do not arrive, or the
// grid does not hold the map. Precondition: the map is flip-free by the exact test. stats:
// "carried" ("at once", "pulled", or "not").
// Throws NotConverged (kFactorizationFailed), TimeIsOver, Cancelled.
std::optional<Points2> carried_to(const CutMap& map, const Points2& goal,
                                  const std::vector<char>& held, ExecutionContext& context,
                                  Stats& stats);

}  // namespace flipfree::distortion
