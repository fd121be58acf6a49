// What automatic seams are asked for.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

struct SeamOptions {
  bool find = false;  // seams are found where those given leave too much distortion
  // Lengths may change by this factor, about: the mean energy of a surface's islands is at most the
  // mean of the factor and its inverse. Above 1.
  double stretch = 1.25;
  // Edges as vertex pairs, and for each by how much a seam there costs more than its length: below
  // 1 is sought, above 1 avoided, infinite never taken.
  IndexPairs weighted;
  std::vector<double> weights;
  // Edges whose faces differ by more than this angle are seams; 0: none.
  double sharp_angle = 0.0;
  bool edges_only = false;  // maps are not wanted: seams found by the end of the time will do
};

// The largest mean energy that a stretch allows.
constexpr double energy_bound(double stretch) { return 0.5 * (stretch + 1.0 / stretch); }

}  // namespace flipfree::unwrap
