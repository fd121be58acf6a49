// A layout that grows: shapes push each other aside until none can grow any more.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/unwrap/packing/nest/shape.h"

namespace flipfree::unwrap {

struct InflateOptions {
  double margin = 0.0;  // least gap between shapes; half of it to the border of the unit tile
  std::vector<char> may_turn;                // per shape, by any angle; empty: all may
  double most_scale = 0.0;                   // not larger than this; 0: no end
  const std::vector<Loop>* fixed = nullptr;  // in the plane, counter-clockwise
  // Steps of contacts' corrections in all.
  double work = 0.0;
};

struct Layout {
  std::vector<Pose> poses;
  double scale = 0.0;
};

// Position-based dynamics: the scale grows by a little, then every contact that is too close moves
// and turns its two shapes apart, by their masses, until all gaps are as wide as they shall be;
// layouts that come to rest are kept, of those that do not the growth is halved. The layout
// returned has all gaps (along contacts, contacts.h), and the scale of the given one at least if
// that had them; otherwise it may be smaller. Deterministic. Cost: `work`.
Layout inflate(const std::vector<Shape>& shapes, const Layout& start, const InflateOptions& options,
               const ExecutionContext& context);

}  // namespace flipfree::unwrap
