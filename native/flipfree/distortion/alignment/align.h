// A seamless map brought to follow directions on its surface.
//
//   E = sum over faces of area ( |J - T|^2 / 2 + smoothness * (|J|^2 + |J^-1|^2) / 4 )
//
// T turns the wished direction to the u axis and scales by `size` (Bommes, Zimmer, Kobbelt 2009,
// "Mixed-Integer Quadrangulation": orientation and sizing); the symmetric Dirichlet energy, with a
// small weight, keeps triangles from flipping (thesis 6.6.3). Seams are eliminated, steps are
// projected Newton steps, no step is taken that the exact test refuses.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion {

struct AlignOptions {
  // Per face of the cut surface: the direction that shall become +u, from the half-edge 3 f,
  // counter-clockwise, radians. Across cuts it differs by the seam's quarter turns.
  std::vector<double> direction;
  // Per face: length in the map of a surface length 1, relative to the others; empty: all alike.
  std::vector<double> size;
  double smoothness = 0.03;
  int max_iterations = 100;
  double tolerance = 1e-4;  // of the energy, as MinimizeOptions has it
};

// The map's new UVs, #V x 2 of the cut surface, which meets its seams as the given one does.
// Where map.straight says so its boundary runs along the axes, and stays there.
// Precondition: every triangle is positively oriented by the exact test. stats: "alignment.energy"
// and "alignment.energy_start" (of |J - T|^2 / 2). Ends
// early when time is over or the map is accepted. Throws InvalidInput (kFlippedMap, kBadShape),
// NotConverged (kFactorizationFailed), Cancelled. Cost: a factorization for each step.
Points2 align(const CutMap& map, const AlignOptions& options, ExecutionContext& context,
              Stats& stats);

// A map aligned to features as well: edges that run along the axes exactly, as far as they can.
struct FeatureAlignment {
  Points2 uv;
  std::vector<StraightEdge> features;  // the ones that are met, up to rounding
};

// As align(), with `features`: edges inside, and how the wished directions let each run. A penalty
// for what they are off, of growing weight, brings them near; then they become constraints like a
// straight boundary, where that turns no triangle over and shrinks none to a hundredth. The ones
// that stay off, and one at each such triangle, are given up and the others tried again; all where
// time ends before, or where the map would be far from the directions everywhere. stats and
// errors: as align(). Cost: that of align(), some times.
FeatureAlignment align_with_features(const CutMap& map, const AlignOptions& options,
                                     const std::vector<StraightEdge>& features,
                                     ExecutionContext& context, Stats& stats);

// How far the map's isolines are from the directions and those across them: the mean of the angles
// of the u and of the v isoline with the nearest of the four; and the face's share of the area, as
// (radians, share) per face. Cost: O(#F).
Points2 angles_off(const CutMap& map, const std::vector<double>& direction, const Points2& uv,
                   const ExecutionContext& context);

}  // namespace flipfree::distortion
