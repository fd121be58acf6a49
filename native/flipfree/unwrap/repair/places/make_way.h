// Which of the charts that lie on others have to move.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::unwrap {

// Of a map, sides along the axes.
struct BoundingBox {
  Eigen::RowVector2d low, high;
  explicit BoundingBox(const Points2& uv)
      : low(uv.colwise().minCoeff()), high(uv.colwise().maxCoeff()) {}
  bool meets(const BoundingBox& other) const {
    return (low.array() < other.high.array()).all() && (other.low.array() < high.array()).all();
  }
};

struct StandingChart {
  const Triangles* faces = nullptr;
  const Points2* uv = nullptr;  // #V x 2, finite
  const Points2* before =
      nullptr;  // null: it stood as it does. What it lay on there, it may lie on.
  bool may_move = false;
};

// Flags of the charts that have to make way: those that may not move stay, then the others, those
// of most faces first, each unless it shares area with one that stays - and `all_apart`, or it did
// not before, or has no `before`. Throws Cancelled, TimeIsOver. Cost: O(n log n) for n charts side
// by side, and O(#F) of a pair whose boxes meet.
std::vector<char> make_way(const std::vector<StandingChart>& charts, bool all_apart,
                           const ExecutionContext& context);

}  // namespace flipfree::unwrap
