// What automatic seams are asked for.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

struct SeamOptions {
  bool find = false;  // seams are found where those given leave too much distortion
  // Lengths may change by this factor, about: every island keeps stretch_bound(). Above 1.
  double stretch = 1.25;
  // Edges as vertex pairs, and for each by how much a seam there costs more than its length: below
  // 1 is sought, above 1 avoided, infinite never taken.
  IndexPairs weighted;
  std::vector<double> weights;
  // Edges whose faces differ by more than this angle are seams; 0: none.
  double sharp_angle = 0.0;
  bool edges_only = false;  // maps are not wanted: seams found by the end of the time will do
};

// How much a map is stretched, or may be.
struct Stretch {
  double energy = 1.0;  // its mean, at the map's best scale
  // Of the triangles that a hundredth of the area is stretched more than: the factor by which their
  // lengths or areas change, up or down, whichever is most.
  double ratio = 1.0;

  bool within(const Stretch& most) const { return energy <= most.energy && ratio <= most.ratio; }
};

// The most that SeamOptions::stretch allows an island.
constexpr Stretch stretch_bound(double stretch) {
  return {0.5 * (stretch + 1.0 / stretch), 1.0 + 3.0 * (stretch - 1.0)};
}

}  // namespace flipfree::unwrap
