// Which of the charts that lie on others have to move.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/packing/place.h"
#include "flipfree/unwrap/repair/mend_chart.h"

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
// not before, or has no `before`. Throws Cancelled, TimeIsOver. Cost: O(n log n) and a comparison
// of boxes for charts above each other, O(#F) of a pair whose boxes meet.
std::vector<char> make_way(const std::vector<StandingChart>& charts, bool all_apart,
                           const ExecutionContext& context);

// One scale for the charts of a map of which most have one.

struct ScaledChart {
  const mesh::Surface* surface = nullptr;
  const Points2* uv = nullptr;  // #V x 2, positive faces, as the texture shows them
  bool remade = false;          // it may be scaled
};

// Per chart the factor that gives it the density (median_density()) which two thirds by area of the
// others, those not remade, have within a tenth; 1 for these, and for all where they have none in
// common. Without any that are not remade, the others' own are asked. Cost: O(#F log #F).
std::vector<double> to_one_scale(const std::vector<ScaledChart>& charts);

// Mended charts, put where they belong and stored.

struct ChartToSettle {
  Points2 uv;  // #V x 2
  Place place = Place::kStays;
  KeptAsStored kept;  // does not overlap itself, pinned vertices
  Points2 before;     // #V x 2, or empty: as `uv`. What it lay on there, it may lie on.
};

struct SettledCharts {
  std::vector<Points2> uv;
  std::vector<Points2f> stored;
  std::vector<char> moved;
  std::vector<std::size_t> unstorable;  // charts that 32 bits do not hold; then nothing else counts
};

// Charts without a place, those near to it that lie on others, and with options.disjoint all that
// lie on larger ones, are packed where the unit square has room for them, or put to the right of
// it and of the map; the others stay. sized: the charts' sizes mean something, and are kept; else
// those that move get the largest common scale. Throws what place_charts() throws.
SettledCharts settle(const std::vector<mesh::Chart>& charts, std::vector<ChartToSettle> mended,
                     bool sized, const RepairOptions& options, ExecutionContext& context);

}  // namespace flipfree::unwrap
