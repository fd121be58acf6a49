// Loops that turn are exchanged for loops that do not (thesis 5.4.1 takes the shortest ones).
//
// A padded map's loops are straight but for what padding bends: a loop that turns in the flat
// angles of the surface asks the metric of the cut disk for as much along its sides.
#pragma once

#include <span>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/straight/flat_angles.h"
#include "flipfree/seamless/padding/straight/turning_path.h"

namespace flipfree::seamless {

// The cheapest cycle that meets this loop in one vertex, where it crosses it from the right to the
// left, and no other curve, and turns by less than an eighth; empty if none is found that costs
// less than `most`. `loop`: vertices in order, drawn, with no connectors.
std::vector<VertexId> crossing_cycle(const TurnMeter& meter, const std::vector<VertexId>& loop,
                                     const TurningPrice& price, double most,
                                     const ExecutionContext& context);

// What a loop costs.
double loop_cost(const TurnMeter& meter, const std::vector<VertexId>& loop,
                 const TurningPrice& price);

// Exchanges each loop that turns by an eighth and more for the cheapest cycle that crosses it, if
// that one costs less. The loops stay disjoint, and no sum of them bounds: no other one crosses
// what the new one does. Preconditions: the loops are drawn on `canvas`, which is the meter's; so
// may others be. Cost: some searches per vertex of such a loop.
void straighten_loops(Canvas& canvas, const TurnMeter& meter, const TurningPrice& price,
                      std::span<std::vector<VertexId>> loops, const ExecutionContext& context);

}  // namespace flipfree::seamless
