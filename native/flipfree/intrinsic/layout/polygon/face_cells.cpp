#include "flipfree/intrinsic/layout/polygon/face_cells.h"

#include <algorithm>
#include <cstddef>

namespace flipfree::intrinsic {
std::vector<std::array<Index, 2>> face_chords(const std::array<Index, 3>& count,
                                              const std::vector<SidePlace>& place) {
  // Per side, the position in the polygon of every corner and point; kInvalid where it is missing.
  std::array<std::vector<Index>, 3> position;
  for (std::size_t k = 0; k < 3; ++k) position[k].assign(at(count[k]) + 1, kInvalid);
  for (std::size_t i = 0; i < place.size(); ++i)
    position[at(place[i].side)][at(place[i].place)] = static_cast<Index>(i);
  std::vector<std::array<Index, 2>> chords;
  const auto add = [&](Index a, Index b) {
    if (a != kInvalid && b != kInvalid) chords.push_back({std::min(a, b), std::max(a, b)});
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t out = k, across = (k + 1) % 3, in = (k + 2) % 3;
    const Index n_out = count[out], n_across = count[across], n_in = count[in];
    // Around the corner where `in` ends and `out` begins.
    const Index around = std::clamp((n_out + n_in - n_across) / 2, Index{0}, std::min(n_out, n_in));
    for (Index i = 1; i <= around; ++i) add(position[out][at(i)], position[in][at(n_in + 1 - i)]);
    // From that corner to the side opposite to it, between those around its ends.
    for (Index i = n_out + 1; i <= n_across - n_in; ++i)
      add(position[out][0], position[across][at(i)]);
  }
  return chords;
}

bool triangulate_cells(const std::vector<PolygonVertex>& polygon,
                       const std::vector<std::array<Index, 2>>& chords, Storage storage,
                       std::vector<PolygonTriangle>& triangles, const ExecutionContext& context) {
  triangles.clear();
  std::vector<std::array<Index, 2>> sorted = chords;
  // By the later end; of one end, the shortest first.
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a[1] != b[1] ? a[1] < b[1] : a[0] > b[0]; });
  std::vector<Index> open;  // what no chord has cut off yet
  std::vector<PolygonVertex> cell;
  std::vector<PolygonTriangle> local;
  const auto close = [&](std::size_t first) {
    if (open.size() - first < 3) return true;
    cell.clear();
    for (std::size_t i = first; i < open.size(); ++i) cell.push_back(polygon[at(open[i])]);
    if (!triangulate_polygon(cell, {}, storage, local, context)) return false;
    for (const PolygonTriangle& t : local) {
      triangles.push_back({open[first + at(t[0])], open[first + at(t[1])], open[first + at(t[2])]});
    }
    return true;
  };
  std::size_t next = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    open.push_back(static_cast<Index>(i));
    for (; next < sorted.size() && at(sorted[next][1]) == i; ++next) {
      std::size_t first = open.size();
      while (first > 0 && open[first - 1] != sorted[next][0]) --first;
      if (first-- == 0) return false;
      if (!close(first)) return false;
      open.resize(first + 1);
      open.push_back(static_cast<Index>(i));
    }
  }
  return close(0);
}

}  // namespace flipfree::intrinsic
