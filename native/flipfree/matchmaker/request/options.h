// How a match is made.
#pragma once

#include "flipfree/matchmaker/request/devices.h"

namespace flipfree::matchmaker {

enum class MatchEngine {
  kAuto,        // first try, then MatchMaker++
  kFirstTry,    // for tests and papers: NotConverged if the first try fails
  kOutline,     // for tests and papers: straight to the homotopy of outlines (ways/outlined.h)
  kOverlay,     // for tests and papers: straight to the outline in one step (ways/outlined.h)
  kArms,        // for tests and papers: straight to an arm for every pin (arms.h)
  kMatchmaker,  // for tests and papers: straight to MatchMaker++
};

struct MatchOptions {
  bool optimise = true;  // lower the distortion with all constraints held
  bool bijective =
      false;  // with a free boundary: the map must be one-to-one as a whole, not only locally
  int max_iterations = 200;
  MatchEngine engine = MatchEngine::kAuto;
  // Of the clock; 0: no limit. The ways share them (time_share.h). Once a map meets all
  // constraints, it is returned in the end, however little time there was to make it better.
  double max_seconds = 0;
  // What a benchmark switches off to see what it earns.
  Devices ablated = 0;
};

}  // namespace flipfree::matchmaker
