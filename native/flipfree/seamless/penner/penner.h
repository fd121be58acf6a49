// The engine "penner": a seamless map in doubles from cones, up to the rounding of its metric.
//
// metric with the cones and quarter-turn loops (penner_metric.h) -> overlay -> layout along a cut
// graph through all cones -> refinement of the input where a triangle would flip -> certificate.
// What comes out is locally injective; the two sides of every seam differ by a quarter turn and a
// translation up to `seam_error`. Making them agree exactly, in 32 bits too, is the next stage's.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/penner/penner_metric.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {

// Finds the metric of one connected surface: compute_penner_metric(), or another engine's.
using MetricSolver =
    std::function<PennerMetric(const mesh::Surface& surface, const std::vector<Index>& cones,
                               const std::optional<std::vector<LoopTurn>>& loops,
                               const PennerOptions& options, ExecutionContext& context)>;

struct PennerMapOptions {
  PennerOptions metric;  // its max_seconds are those of the whole map
  MetricSolver solver = compute_penner_metric;
  IndexPairs uncuttable;  // edges that the cut avoids: diagonals of polygons
  std::int64_t max_crossings = 20'000'000;
};

struct PennerMap {
  // uv valid in 64 bits (certificate.flips64 is 0, cones and winding hold there); cut_edges and
  // transitions along `branches`, quarter turns exact, translations rounded. Several components
  // have one chart each, side by side, all at one scale.
  certify::Parametrization map;
  std::vector<SeamBranch> branches;
  std::vector<Index> cones;         // as given; with an aligned boundary, its corners chosen
  std::vector<LoopTurn> loops;      // on the input's faces, of all components
  double seam_error = 0.0;          // largest distance between two sides, uv units
  std::optional<Error> not_stored;  // why the 32-bit values are no valid map, if they are none
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
// is that one's face faces[f]. `cones`, `loops`, options: its own. Branches are not yet found.
using ComponentMapper = std::function<PennerMap(
    const mesh::Surface& component, const std::vector<Index>& cones,
    const std::optional<std::vector<LoopTurn>>& loops, const PennerMapOptions& options,
    const std::vector<FaceId>& faces, ExecutionContext& context)>;

// One of them by the first attempt, from that of the options on, that finds a metric, and where
// that cannot be written as a map in 64 bits, by the next one.
PennerMap map_component(const mesh::Surface& surface, const std::vector<Index>& cones,
                        const std::optional<std::vector<LoopTurn>>& loops,
                        const PennerMapOptions& options, ExecutionContext& context);

// compute_penner_map() with another mapper in place of map_component(). Errors of components name
// places of the surface.
PennerMap map_each_component(const mesh::Surface& surface, const std::vector<Index>& cones,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerMapOptions& options, const ComponentMapper& map_one,
                             ExecutionContext& context);

}  // namespace flipfree::seamless
