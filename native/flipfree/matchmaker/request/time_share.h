// How the ways to a map share the time that a call has (MatchOptions::max_seconds).
//
//   |<------------------------------ max_seconds ------------------------------>|
//   | one way, its share | the next, its share of the rest | ... | the last way  |
//                              a way arrived: taking refinement back, optimising, storing
//
// A way that runs out of its share is given up for the next. Once there is a map that meets all
// constraints, nothing is given up any more: what is over ends, with the best map so far.
#pragma once

namespace flipfree::matchmaker {

// Of the time that is left: for a way that others follow, and for each of the steps that follow a
// way that arrived, but the last.
constexpr double kShareOfWay = 0.5;
constexpr double kShareOfStep = 0.4;

}  // namespace flipfree::matchmaker
