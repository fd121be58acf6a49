// The engine "penner": a seamless map in doubles from cones, up to the rounding of its metric.
//
// metric with the cones and quarter-turn loops -> overlay -> layout along a cut
// graph through all cones -> refinement of the input where a triangle would flip -> certificate.
// What comes out is locally injective; the two sides of every seam differ by a quarter turn and a
// translation up to rounding. Making them agree exactly, in 32 bits too, is the next stage's.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

// On the input's faces: half-edges 3 f + k.
using intrinsic::LoopTurn;

// The loops of a homology basis of the input, short ones, in half-edges of its faces, with turns of
// zero; with a boundary, of the surface with every curve of it contracted, and where that is
// aligned, strips from its first curve to each other one: all that is left to choose once the
// angles at vertices are.
std::vector<LoopTurn> loops_to_turn(const mesh::Surface& surface, bool aligned,
                                    const ExecutionContext& context);

// A flat metric with prescribed cone angles and loop angles, all in quarter turns: the metric of a
// seamless map (Capouellez, Zorin 2024; design: Penner coordinates without the chain rule).
//
// Starts from the discretely conformal metric with the same cones, so that only the loops are left;
// then Newton's method (penner_newton.h), for other turns where that stalls, and relaxation
// (penner_newton.h) where the scale spans much. The overlay of the input with the final
// triangulation is what the flips lead to: the metric changes between them in any way, isotopy
// classes do not care.

struct PennerOptions {
  Boundary boundary = Boundary::kAligned;
  int max_iterations = 200;  // Newton steps for one choice of turns, conformal start not counted
  IndexPairs uncuttable;     // edges that the map's cut avoids: diagonals of polygons
};

struct PennerMetric {
  std::vector<double> angles;  // per vertex, that were asked for
  // The metric, its triangulation and the flips that lead there (Euclidean and Ptolemy flips of the
  // conformal start, then Ptolemy flips of this one). `u`: the conformal part of the change.
  conformal::ConformalMetric metric;
  std::vector<LoopTurn> loops;  // on the input
  Stats stats;
};

// `cones`: quarter turns per vertex, 4 where it is flat; at the boundary as aligned_cones() returns
// them, or kNotGiven where it is free. `loops`: none: a homology basis with the turns that the
// conformal metric is nearest to and that some metric has. Given ones must generate the homology
// and be independent there. With a boundary: of the surface with every curve of it contracted, 2 g;
// to these come, where it is aligned, strips from the first curve to the others.
// Precondition: a valid, connected surface. Errors: request.h; InvalidInput
// (loops of the wrong number, or that are no closed strips), NotConverged (says
// what was reached), Cancelled.
PennerMetric compute_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   const std::optional<std::vector<LoopTurn>>& loops,
                                   const PennerOptions& options, ExecutionContext& context);

// The same from another metric of this closed surface with these cones, whose loops turn by quarter
// turns already, all but for its errors: what these leave is met by Newton's method, then relaxed.
PennerMetric finish_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                  conformal::ConformalMetric start, const PennerOptions& options,
                                  ExecutionContext& context);

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
// Errors: InvalidInput (defects of the mesh; cones), Infeasible (request.h), NotConverged,
// Cancelled.
PennerMap compute_penner_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerOptions& options, ExecutionContext& context);

// A connected surface, a component of another one: its face f, with the same corners, is that one's
// face faces[f]. Cones, loops and options are its own.
struct Component {
  const mesh::Surface& surface;
  const std::vector<Index>& cones;
  const std::optional<std::vector<LoopTurn>>& loops;
  const PennerOptions& options;
  const std::vector<FaceId>& faces;
  ExecutionContext& context;
};
using ComponentMapper = std::function<PennerMap(const Component& component)>;

// Its second half: overlay, layout and refinement. `solved`: of this connected surface and cones.
PennerMap map_from_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                          PennerMetric solved, const PennerOptions& options,
                          ExecutionContext& context);

// compute_penner_map() with another mapper of components. Errors of components name places of the
// surface.
PennerMap map_each_component(const mesh::Surface& surface, const std::vector<Index>& cones,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerOptions& options, const ComponentMapper& map_one,
                             ExecutionContext& context);

}  // namespace flipfree::seamless
