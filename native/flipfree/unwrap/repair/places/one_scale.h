// One scale for the charts of a map of which most have one.
#pragma once

#include <vector>

#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

struct ScaledChart {
  const mesh::Surface* surface = nullptr;
  const Points2* uv = nullptr;  // #V x 2, positive faces, as the texture shows them
  bool remade = false;          // it may be scaled
};

// Per chart the factor that gives it the density (median_density()) which two thirds by area of the
// others, those not remade, have within a tenth; 1 for these, and for all where they have none in
// common. Without any that are not remade, the others' own are asked. Cost: O(#F log #F).
std::vector<double> to_one_scale(const std::vector<ScaledChart>& charts);

}  // namespace flipfree::unwrap
