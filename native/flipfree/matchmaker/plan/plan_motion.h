// On which side pins pass each other on their way, all together: the choice that decides how far a
// map inside a prescribed boundary is drawn out.
//
// Brought home one after another, thirty pins wind around each other so often that the edges
// between their sources cross those between their targets 10^4 to 10^5 times; 1600 is enough. As
// moving_pins.h tells the number for any motion in a fraction of a millisecond, motions are simply
// tried: all pins go along straight lines to a place on the way, then to their targets, and these
// places are found by simulated annealing (Kirkpatrick, Gelatt, Vecchi 1983).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/plan/moving_pins.h"

namespace flipfree::matchmaker {

struct PinMove {
  VertexId pin;  // its place in the list of sources
  Vector2 to;    // straight
};

// A motion from `from` to `to` inside the rim, one move after another, with few crossings. Empty if
// none was found that doubles can follow. Preconditions: the rim is strictly convex, sources and
// targets are strictly inside, each distinct. The same for any number of threads. Cost: about 2 s
// for thirty pins, growing with the square of their number.
std::vector<PinMove> plan_motion(const Polygon& rim, const std::vector<Vector2>& from,
                                 const std::vector<Vector2>& to, ExecutionContext& context);

}  // namespace flipfree::matchmaker
