// Surfaces of any genus and cones on them.
#pragma once

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include "support/shapes.h"

namespace flipfree::test {

inline mesh::Surface of_genus(Index genus, Index fineness) {
  if (genus == 0) return sphere(6 * fineness, 4 * fineness);
  if (genus == 1) return torus(8 * fineness, 6 * fineness);
  return perforated_plate(genus, fineness);
}

// The given cones at vertices that the seed chooses, all others flat.
inline std::vector<Index> scattered(const mesh::Surface& surface, const std::vector<Index>& given,
                                    unsigned seed) {
  std::vector<VertexId> vertices(static_cast<std::size_t>(surface.vertices.rows()));
  std::iota(vertices.begin(), vertices.end(), 0);
  std::mt19937 random(seed);
  for (std::size_t i = vertices.size() - 1; i > 0; --i)
    std::swap(vertices[i], vertices[random() % (i + 1)]);
  std::vector<Index> cones(vertices.size(), 4);
  for (std::size_t i = 0; i < given.size(); ++i)
    cones[static_cast<std::size_t>(vertices.at(i))] = given[i];
  return cones;
}

// `count` cones of 3 and 5 quarter turns on a surface of this genus; the sum decides how many of
// each.
inline std::vector<Index> random_cones(const mesh::Surface& surface, Index genus, Index count,
                                       unsigned seed) {
  const auto sharp = static_cast<std::size_t>((count + 8 - 8 * genus) / 2);
  std::vector<Index> given(static_cast<std::size_t>(count), 5);
  std::fill_n(given.begin(), sharp, 3);
  return scattered(surface, given, seed);
}

}  // namespace flipfree::test
