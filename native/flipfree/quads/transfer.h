// From whole numbers on a coarse surface back to the map: the integer parametrization.
#pragma once

#include <optional>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/quads/coarse.h"

namespace flipfree::quads {

// The map of `input` in which the edges of the coarse surface are the integers that were chosen
// for them: translations, cones, corners, borders and features are whole numbers, as stored in 32
// bits. Every chart stays where it is, at the new scale, but for less than one. The way begins at
// the affine maps between the coarse triangles, as the map's edges cross them
// (distortion/seams/seams.h). Where these flip triangles and no way without them is found, edges
// get points where they bend, as few as the map can do with in the end: then nothing flips. nullopt
// only where 32 bits do not hold the map. Without certificate. stats: as carried_to().
std::optional<certify::Parametrization> integer_map(const certify::Parametrization& map,
                                                    const mesh::Surface& input,
                                                    const Prepared& prepared,
                                                    const CoarseSurface& chosen,
                                                    ExecutionContext& context, Stats& stats);

// The same for any map, `scale` times as large, by rounding each free translation: for borders that
// run along no axis. They stay as they are; nullopt where no way is found.
std::optional<certify::Parametrization> rounded_map(const certify::Parametrization& map,
                                                    const FlatMap& flat, double scale,
                                                    ExecutionContext& context, Stats& stats);

// Fills uv32, the cut and its transitions of a map whose uv are such integers, and certifies it
// (G1, G2, G4, G5: cones of `quarters`, by vertex; of `features`, edges of the input, those that
// are no isolines are named).
void certify_integers(const std::vector<Index>& quarters, const mesh::Surface& input,
                      const IndexPairs& features, certify::Parametrization& map,
                      const ExecutionContext& context);

}  // namespace flipfree::quads
