// Charts of one outline, to lie on top of each other.
#pragma once

#include <vector>

#include "flipfree/mesh/cut.h"

namespace flipfree::unwrap {

// The chart's outline, from its corner `first` on, is that of the other from its first corner on,
// turned and moved.
struct Stacked {
  std::size_t chart = 0;
  std::size_t on = 0;
  std::size_t first = 0;
};

// Of the charts that move, those whose outline, turned and moved but neither scaled nor mirrored,
// is that of one before them to a thousandth of its size, corner for corner. Only charts with one
// outline each. Cost: O(c n^2) for c charts of the same number n of corners and about one area.
std::vector<Stacked> similar_charts(const std::vector<mesh::Chart>& charts,
                                    const std::vector<Points2>& uv, const std::vector<char>& moved);

// Puts the chart's map (as similar_charts saw it, `before`) on that of the other, where that lies
// now, at the other's scale.
void put_on(const std::vector<mesh::Chart>& charts, const Stacked& stacked,
            const std::vector<Points2>& before, std::vector<Points2>& uv);

}  // namespace flipfree::unwrap
