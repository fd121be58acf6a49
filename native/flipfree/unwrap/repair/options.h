// What a repair is asked for (repair.h).
#pragma once

#include <vector>

#include "flipfree/certify/certify.h"

namespace flipfree::unwrap {

// What happens to a chart that lies on itself though no triangle is flipped.
enum class SelfOverlaps {
  kKeep,  // it stays
  kOpen,  // it is held apart: no further cut
  kCut,   // it falls into pieces that are put side by side
};

// What becomes of islands that are drawn out more than an unwrap of them is (mend_chart.h).
enum class StretchedIslands {
  kIgnore,   // they stay
  kCount,    // they stay, and are counted
  kImprove,  // they are made better, at the scale that most others have (settle.h)
};

struct RepairOptions {
  IndexPairs cuts;        // seams: the map is cut there where it has to be made anew
  IndexPairs uncuttable;  // edges that automatic cuts avoid: diagonals of polygons
  std::vector<certify::CornerPin>
      pins;  // met bit for bit; corners that share a place share its pin
  SelfOverlaps overlaps = SelfOverlaps::kCut;
  StretchedIslands stretched = StretchedIslands::kCount;
  bool disjoint = false;     // charts that lie on others are moved to where there is room
  double margin = 0.005;     // around charts that are moved
  int max_iterations = 200;  // of the optimiser, per chart that is made anew
  double tolerance = 1e-4;
  double max_seconds = 0;  // of the clock; 0: no limit
  double aspect = 1.0;     // CertifyRequest::aspect: what is made anew has its shape on the texture
};

}  // namespace flipfree::unwrap
