// How the ways to a map share the time that a call has (MatchOptions::max_seconds).
//
//   |<------------------------------ max_seconds ------------------------------>|
//   | one way, its share | the next, its share of the rest | ... | the last way  |
//                              a way arrived: taking refinement back, optimising, storing
//
// A way that runs out of its share is given up for the next. Once there is a map that meets all
// constraints, nothing is given up any more: what is over ends, with the best map so far.
#pragma once

#include <cstdint>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/stats.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// Of the time that is left: for a way that others follow, and for each of the steps that follow a
// way that arrived, but the last.
constexpr double kShareOfWay = 0.5;
constexpr double kShareOfStep = 0.4;

inline void note_time_limit(Stats& stats) { stats["time_limit_reached"] = std::int64_t{1}; }

// Runs `steps`, each of which makes the valid map better in place and leaves it valid wherever a
// check throws. False if time was over before they ended.
template <typename Steps>
bool while_time_lasts(mesh::RefinedMap& map, Steps&& steps) {
  if (ended_in_time(std::forward<Steps>(steps))) return true;
  map = mesh::compacted_map(map);  // of vertices that are gone
  return false;
}

}  // namespace flipfree::matchmaker
