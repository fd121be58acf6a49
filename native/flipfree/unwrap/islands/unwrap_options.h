// What an unwrap is asked for (unwrap.h).
#pragma once

#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/certify/certify.h"
#include "flipfree/unwrap/islands/seam_options.h"

namespace flipfree::unwrap {

struct UnwrapOptions {
  IndexPairs cuts;        // seam edges as vertex pairs
  IndexPairs uncuttable;  // edges that automatic cuts avoid: diagonals of polygons
  std::vector<certify::CornerPin>
      pins;  // met bit for bit; corners that share a vertex of a chart share the pin
  // #F, or empty: where more than two faces meet at an edge, those of one material rather go
  // together.
  std::vector<Index> material;
  // #F, or empty: triangles of one polygon, which stay in one piece (islands of their own if need
  // be). Where it is empty, `uncuttable` tells them.
  std::vector<Index> polygon;
  SeamOptions seams;      // beyond `cuts`; not with pins
  bool bijective = true;  // no chart overlaps itself
  // Charts that have to be cut open anyway are slit to their extremities too (extremities.h). Not
  // done if there are pins: both sides of a slit through a pinned vertex would share its place.
  bool cut_extremities = true;
  // With `bijective`, charts without pins that cannot be laid out without overlap at a distortion
  // near that of their free map are cut along further edges (separate.h) instead of crushed.
  bool may_add_cuts = true;
  int max_iterations = 200;  // of the optimiser, per chart
  double tolerance = 1e-4;   // share of the energy that a step must still promise
  // Of the clock; 0: no limit. Charts that are flat by then are made no better.
  double max_seconds = 0;
  double margin = 0.005;  // between charts, in units of the unit square
  double effort = 0.2;    // of the search for a dense layout (packing/nest); 0: boxes
  // Former corner UVs (3 #F x 2) whose places are kept if that leaves a usable layout (place.h), or
  // null. Otherwise all charts without pins are packed, clear of those with pins.
  const Points2* place_like = nullptr;
};

}  // namespace flipfree::unwrap
