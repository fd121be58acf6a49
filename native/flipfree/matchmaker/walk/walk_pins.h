// Brings pins to their targets along maps that are all flip-free, refining the surface only where
// the way is blocked.
//
// First all pins together by continuation (distortion/targets.h). If that stops, many pins inside a
// convex boundary are planned together (planned_walk.h), and where the boundary is free and the map
// may overlap itself, every pin gets an arm of its own (arms.h). Otherwise they go one after
// another, the nearest first, each held once it has arrived; pins that wait are free, so the others
// do not wind around them. A pin that continuation does not bring home is pushed (push_point.h)
// along a way past the held pins (corridor.h), the map relaxed, and refinement taken back
// (coarsen.h) before the next. Every map on the way is valid, so nothing has to be repaired, and
// interior vertices keep winding once, which untangling with a free boundary does not ensure.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

enum class WalkMode { kNone, kTogether, kPlanned, kArms, kOneByOne };

struct Walk {
  bool arrived = false;  // all pins, bit for bit: the map is the result, otherwise one on the way
  WalkMode mode = WalkMode::kNone;  // that led there, or was tried last
  bool exhausted = false;           // given up as it would take out of proportion long
  bool settled = false;             // coarsen() has nothing to add
};

// Precondition: map.uv is flip-free, a prescribed boundary is at its targets. Without
// `refine` no vertex is added and nothing pushed. In exact arithmetic pushes always arrive; in
// doubles they can fail where a map has become so narrow that new vertices cannot be told apart, or
// where one push would add more than a few times the input's vertices. A walk that would take out
// of proportion long, as every push leaves more refinement behind, is given up.
// Lines and targets that overlap themselves are not pushed at all. Stats: "walk.*".
Walk walk_pins(mesh::RefinedMap& map, const Constraints& constraints, bool refine,
               ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
