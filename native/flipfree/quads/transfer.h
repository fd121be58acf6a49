// From whole numbers on a coarse surface back to the map: the integer parametrization.
#pragma once

#include <optional>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/quads/prepared.h"

namespace flipfree::quads {

// Corner UVs (3 #F x 2) of the map in which the edges of the coarse surface are the integers that
// were chosen for them: translations, cones, corners, borders and features are whole numbers, as
// stored in 32 bits. Every chart stays where it is, at the new scale, but for less than one. The
// way begins at the affine maps between the coarse triangles, as the map's edges cross them
// (distortion/seams/carry.h, which says what is promised, and why there may be none).
std::optional<Points2> integer_uv(const certify::Parametrization& map, const Prepared& prepared,
                                  const CoarseSurface& chosen, ExecutionContext& context,
                                  Stats& stats);

// The same for any map, `scale` times as large, by rounding each free translation: for borders that
// run along no axis. They stay as they are.
std::optional<Points2> rounded_uv(const certify::Parametrization& map, const FlatMap& flat,
                                  double scale, ExecutionContext& context, Stats& stats);

// Fills uv, uv32, the cut and its transitions of a map that has `integers` for UVs, and certifies
// it (G1, G2, G4, G5: the cones that it had; of `features`, edges of the input `parent`, those that
// are no isolines are named).
void set_integer_uv(Points2 integers, const std::vector<Index>& quarters,
                    const mesh::Surface& parent, const IndexPairs& features,
                    certify::Parametrization& map, const ExecutionContext& context);

}  // namespace flipfree::quads
