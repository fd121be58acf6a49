// Shapes nested into the unit tile, larger until nothing is gained or a budget of work is spent.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/plane.h"
#include "flipfree/unwrap/packing/nest/shape.h"

namespace flipfree::unwrap {

// kStraight: quarter turns for shapes whose outlines run along the axes (straight_axis), which look
// askew in any other direction; eighths of a turn for the others.
enum class Rotation { kNone, kQuarters, kStraight, kFree };

struct NestOptions {
  double margin = 0.002;  // least gap, positive; half of it to the tile's border
  Rotation rotation = Rotation::kFree;
  double scale = 0.0;       // wanted; 0: the largest
  std::vector<Loop> fixed;  // to keep clear of, with their inside
  double effort = 1.0;      // at most, about seconds for some hundred shapes
};

// By less than quarters?
inline bool may_turn(const Shape& shape, Rotation rotation) {
  return rotation == Rotation::kFree || (rotation == Rotation::kStraight && !shape.upright);
}

struct Layout {
  std::vector<Similarity> poses;  // p, once scaled, goes to its pose's p: turned and moved
  double scale = 0.0;             // 0: none was found
};

// All gaps are at least the margin; no scale below 0.7 is looked for. Deterministic, the same for
// any number of threads.
Layout nest(const std::vector<Shape>& shapes, const NestOptions& options,
            ExecutionContext& context);

}  // namespace flipfree::unwrap
