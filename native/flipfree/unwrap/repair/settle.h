// Mended charts, put where they belong and stored.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/repair/mend_chart.h"
#include "flipfree/unwrap/repair/repair_options.h"

namespace flipfree::unwrap {

struct ChartToSettle {
  Points2 uv;  // #V x 2
  Place place = Place::kStays;
  bool bijective = false;  // does not overlap itself, and may not as stored
  std::vector<VertexId> pinned;
  Points2 before;  // #V x 2, or empty: as `uv`. What it lay on there, it may lie on.
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
