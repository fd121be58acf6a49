// Cuts of a torus without cones and with two, and the steps up to a flat surface, for tests.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/seamless/padding/padded_metric.h"
#include "seamless/padding/cuts.h"

namespace flipfree::test {

// Straight from corner to corner.
inline Chain polyline(const GridTorus& t, const std::vector<std::pair<Index, Index>>& corners) {
  Chain chain{t.at(corners[0].first, corners[0].second)};
  for (std::size_t k = 1; k < corners.size(); ++k) {
    auto [i, j] = corners[k - 1];
    const auto sign = [](Index x) { return x > 0 ? 1 : x < 0 ? -1 : 0; };
    const Index di = sign(corners[k].first - i), dj = sign(corners[k].second - j);
    while (i != corners[k].first || j != corners[k].second) chain.push_back(t.at(i += di, j += dj));
  }
  return chain;
}

struct ConedCut {
  seamless::AdmissibleCut cut;
  std::vector<Index> cones;
};

// One square.
inline ConedCut square_cut(const GridTorus& t) {
  return {
      drawn_cut(t.surface,
                {polyline(t, {{0, 0}, {t.sectors, 0}}), polyline(t, {{0, 0}, {0, t.rows}})}, {}),
      std::vector<Index>(static_cast<std::size_t>(t.surface.vertices.rows()), 4)};
}

// The example of thesis 5.7: two nodes on a row, two paths from one to the other that leave upwards
// and arrive from below; 2 corners between the paths around a cone of 2, and 6 around one of 6.
inline ConedCut digon_cut() {
  const GridTorus t(16, 16);
  const Chain left = polyline(t, {{4, 0}, {4, 8}, {10, 8}, {10, 14}, {12, 16}});
  const Chain right = polyline(t, {{4, 0}, {6, 2}, {6, 6}, {12, 6}, {12, 16}});
  ConedCut out{
      drawn_cut(t.surface,
                {polyline(t, {{4, 0}, {12, 0}}), polyline(t, {{12, 0}, {20, 0}}), left, right}, {}),
      std::vector<Index>(256, 4)};
  out.cones[static_cast<std::size_t>(t.at(8, 7))] = 2;
  out.cones[static_cast<std::size_t>(t.at(0, 8))] = 6;
  return out;
}

inline mesh::Adjacency adjacency_of(const seamless::AdmissibleCut& cut) {
  return mesh::build_adjacency(static_cast<Index>(cut.surface.vertices.rows()), cut.surface.faces);
}

}  // namespace flipfree::test
