// Where the islands of a run go: one scale for all, packed clear of everything that stays, or back
// to their former places if those are free.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/packing/nest/nest.h"

namespace flipfree::unwrap {

// Charts that move as one.
using Items = std::vector<std::vector<std::size_t>>;

struct PlacingOptions {
  double margin = 0.005;  // see RoomOptions
  // Every group gets the size of its surface; otherwise scales stay in the ratio they have.
  bool scale_true = false;
  // Charts of equal number turn and scale together; empty: each by itself.
  std::vector<Index> group;
  bool rigid = false;  // and keep their places relative to each other: they move as one
  Rotation rotation = Rotation::kStraight;  // groups that are not rigid turn by align() only
  bool stack = false;                       // charts of equal outline go to the same place
  double effort = 1.0;                      // of the search for a dense layout (NestOptions)
  Index first_tile = 0;
  Index tiles = 1;  // that charts are spread over, from the first on (spread.h)
  // Length in the plane per length of the surface, over all that moves: taken if there is room for
  // it. 0: that of the charts that stay, if scale_true and there are any; else the largest.
  double density = 0.0;
  const Points2* obstacles = nullptr;   // 3 k x 2, triangles to keep clear of; finite
  const Points2* place_like = nullptr;  // 3 #F x 2, former corner UVs
};

struct PlacedCharts {
  std::vector<Points2> uv;
  std::vector<Points2f> stored;
  bool kept = false;   // at their former places
  Index tile = 0;      // the first of those taken, see Placement
  Index tiles = 1;     // how many were taken
  Index stacked = 0;   // charts that lie on another one
  Index enlarged = 0;  // groups that are larger than the others' scale would have them
  // All gaps, and half of it to the tile's border, are at least the margin as stored. Not asked of
  // former places.
  bool margin_met = false;
  double fill = 0.0;  // share of the tiles that charts cover that moved, stacked ones once
};

// What a chart keeps when it is stored.
struct KeptAsStored {
  bool bijective = true;        // it does not overlap itself
  std::vector<VertexId> fixed;  // these of its vertices stay bit for bit
};

// Charts that 32 bits do not hold, and why, in terms of the chart.
using Unstorable = std::vector<std::pair<std::size_t, Error>>;

// The values to be stored, chart by chart (distortion/rounding.h); nothing for those in
// `unstorable`. repaired: triangles that rounding alone would have flipped.
std::vector<Points2f> store_charts(const std::vector<mesh::Chart>& charts,
                                   const std::vector<Points2>& uv,
                                   const std::vector<KeptAsStored>& kept, Unstorable& unstorable,
                                   std::int64_t& repaired, const ExecutionContext& context);

// Is no item on top of another or of what stays (3 k x 2: triangles)?
bool disjoint(const std::vector<mesh::Chart>& charts, const Items& items,
              const std::vector<Points2>& uv, const Points2& stays);

// Rounds all charts to what is stored; may throw NotConverged.
using RoundCharts = std::function<std::vector<Points2f>(const std::vector<Points2>&)>;

// Charts that are not `moved` stay as they are. The others keep their former places - turned and
// moved to fit them best, all at one common scale - if every one was a flip-free island of
// place_like and, as stored, none overlaps another, a chart that stays or an obstacle, and none
// leaves the unit square. Otherwise they are packed together: as stored, none overlaps
// another, a chart that stays or an obstacle, and all gaps are at least the margin (RoomOptions) -
// but for charts that no layout tried could both store and keep apart: see margin_met. Throws what
// arrange() and `round` throw. Groups so small beside the others that 32 bits would hold them as a
// point are enlarged until they do not. Cost: O(#F log #F) and the search.
PlacedCharts place_charts(const std::vector<mesh::Chart>& charts, std::vector<Points2> uv,
                          const std::vector<char>& moved, const PlacingOptions& options,
                          const RoundCharts& round, ExecutionContext& context);

// sqrt(area in the plane / area of the surface) of the charts chosen; 0 if there are none.
double density_of(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& uv,
                  const std::vector<char>& chosen);

}  // namespace flipfree::unwrap
