// Where the islands of a run go: one scale for all, packed clear of everything that stays, or back
// to their former places if those are free.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/packing/nest/nest.h"

namespace flipfree::unwrap {

struct PlacingOptions {
  double margin = 0.005;  // between charts, in units of the unit square; half of it to its border
  // Every component (every chart, if they are not together) is scaled to the size of its surface;
  // otherwise scales stay in the ratio they have.
  bool scale_true = false;
  // How charts may be turned; those of one group that turn together keep their directions, but for
  // one turn with kFree.
  Rotation rotation = Rotation::kStraight;
  bool stack = false;  // charts of equal outline go to one place; not in groups
  // With stack: so do mirror images, mirrored. Charts that move may be so in the map that is given.
  bool stack_mirrored = false;
  double effort = 1.0;   // of the search for a dense layout, see NestOptions; 0: boxes
  Index first_tile = 0;  // column + 10 row, where the search for a tile with room begins
  Index tiles = 1;       // that charts are spread over, one scale for all
  // Length in the plane per length of the surface, over all that moves: taken if there is room for
  // it, else the largest that there is room for. 0: that of the charts that stay, if scale_true and
  // there are any; else the largest.
  double density = 0.0;
  // Former corner UVs (3 #F x 2) whose places are kept if that leaves a usable layout.
  std::optional<Points2> place_like;
};

// Charts of equal number turn and scale together; empty: each by itself.
struct Grouping {
  std::vector<Index> group;
  bool rigid = false;  // and keep their places relative to each other: they move as one
};

struct PlacedCharts {
  std::vector<Points2> uv;  // of mirrored charts with u negated, as what is stored: all positive
  std::vector<Points2f> stored;
  std::vector<char> mirrored;  // #charts: stacked as the mirror image
  bool kept = false;           // at their former places
  Index tile = 0;              // the first of those taken, see Placement
  Index tiles = 1;             // how many were taken
  Index stacked = 0;           // charts that lie on another one
  Index enlarged = 0;          // groups that are larger than the others' scale would have them
  // All gaps, and half of it to the tile's border, are at least the margin as stored. Not asked of
  // former places.
  bool margin_met = false;
  double fill = 0.0;  // share of the tiles that charts cover that moved, stacked ones once
};

// "tile", "fill", "margin_met", "kept_places", "enlarged_islands".
void report(const PlacedCharts& placed, Stats& stats);

// What a chart keeps when it is stored.
struct KeptAsStored {
  bool bijective = true;        // it does not overlap itself
  std::vector<VertexId> fixed;  // these of its vertices stay bit for bit
};

// Charts that 32 bits do not hold, and why, in terms of the chart.
using Unstorable = std::vector<std::pair<std::size_t, Error>>;

// The map that charts are of, certified by nobody yet; uv and stored by chart, #V x 2.
certify::Parametrization map_of_charts(const mesh::Surface& surface, const IndexPairs& cut_edges,
                                       const std::vector<mesh::Chart>& charts,
                                       const std::vector<Points2>& uv,
                                       const std::vector<Points2f>& stored);

// The values to be stored, chart by chart (distortion/rounding.h); nothing for those in
// `unstorable`.
struct StoredCharts {
  std::vector<Points2f> uv;
  Unstorable unstorable;
  std::int64_t repaired = 0;  // triangles that rounding alone would have flipped
};
StoredCharts store_charts(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& uv,
                          const std::vector<KeptAsStored>& kept, const ExecutionContext& context);

// Rounds all charts to what is stored; may throw NotConverged.
using RoundCharts = std::function<std::vector<Points2f>(const std::vector<Points2>&)>;

// Charts that are not `moved` stay as they are; obstacles (3 k x 2, finite triangles) are kept
// clear of. The others keep their former places - turned and moved to fit them best, all at one
// common scale - if every one was a flip-free island of place_like and, as stored, none overlaps
// another, a chart that stays or an obstacle, and none leaves the unit square. Otherwise they are
// packed together: as stored, none overlaps another, a chart that stays or an obstacle, and all
// gaps are at least the margin (RoomOptions) - but for charts that no layout tried could both store
// and keep apart: see margin_met. Throws what arrange() and `round` throw. Groups so small beside
// the others that 32 bits would hold them as a point are enlarged until they do not. Cost: O(#F log
// #F) and the search.
PlacedCharts place_charts(const std::vector<mesh::Chart>& charts, std::vector<Points2> uv,
                          const std::vector<char>& moved, const PlacingOptions& options,
                          const Grouping& grouping, const Points2& obstacles,
                          const RoundCharts& round, ExecutionContext& context);

// Areas of the charts chosen (flags), of the surface and in the plane.
struct Areas {
  double surface = 0.0;
  double plane = 0.0;
  double density() const;  // length in the plane per length of the surface; 0: not known
};
Areas areas_of(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& uv,
               const std::vector<char>& chosen);

}  // namespace flipfree::unwrap
