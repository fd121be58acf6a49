// The engine "penner": a seamless map in doubles from cones, up to the rounding of its metric.
//
// metric with the cones and quarter-turn loops (penner_metric.h) -> overlay -> layout along a cut
// graph through all cones -> refinement of the input where a triangle would flip -> certificate.
// What comes out is locally injective; the two sides of every seam differ by a quarter turn and a
// translation up to rounding. Making them agree exactly, in 32 bits too, is the next stage's.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/penner/penner_metric.h"

namespace flipfree::seamless {

struct PennerMapOptions {
  PennerOptions metric;
  IndexPairs uncuttable;  // edges that the cut avoids: diagonals of polygons
};

struct PennerMap {
  // uv valid in 64 bits (certificate.flips64 is 0, cones and winding hold there), with cut_edges;
  // its transitions are not known yet. Several components have one chart each, side by side, all at
  // one scale.
  certify::Parametrization map;
  std::vector<Index> cones;  // as given; with an aligned boundary, its corners chosen
};

// `cones`: quarter turns per vertex, 4 or kNotGiven where it is flat; at boundaries as for
// aligned_cones() and free_angles(). An aligned boundary runs along the axes up to rounding.
// `loops`: as compute_penner_metric(); given ones are those of all components, in any order.
// Errors: InvalidInput (defects of the mesh; cones), Infeasible (signature.h), NotConverged,
// Cancelled.
PennerMap compute_penner_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerMapOptions& options, ExecutionContext& context);

// The map of one connected surface, a component of another one: its face f, with the same corners,
// is that one's face faces[f]. `cones`, `loops`, options: its own.
using ComponentMapper = std::function<PennerMap(
    const mesh::Surface& component, const std::vector<Index>& cones,
    const std::optional<std::vector<LoopTurn>>& loops, const PennerMapOptions& options,
    const std::vector<FaceId>& faces, ExecutionContext& context)>;

// Its second half: overlay, layout and refinement. `solved`: of this connected surface and cones.
PennerMap map_from_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                          PennerMetric solved, const PennerMapOptions& options,
                          ExecutionContext& context);

// compute_penner_map() with another mapper of components. Errors of components name places of the
// surface.
PennerMap map_each_component(const mesh::Surface& surface, const std::vector<Index>& cones,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerMapOptions& options, const ComponentMapper& map_one,
                             ExecutionContext& context);

}  // namespace flipfree::seamless
