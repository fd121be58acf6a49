// Surfaces and cones to make cuts of, and everything that padding needs of a cut, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <set>
#include <vector>

#include "flipfree/seamless/padding/topology.h"
#include "seamless/padding/admissible_judge.h"
#include "seamless/padding/cuts.h"
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

// Definition 5.4 by the judge; a row of ones in the kernel, and full rank, so that the equations
// can be solved by positive widths whatever the lengths are, unless all cones are multiples of four
// (Proposition 10). Returns the corners of the components.
inline std::multiset<Index> expect_good_cut(const seamless::AdmissibleCut& cut,
                                            const mesh::Surface& surface,
                                            const std::vector<Index>& cones) {
  AdmissibleJudge judge(cut, surface, cones);
  EXPECT_EQ(judge.complaint(), "");
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(cut.surface.vertices.rows()), cut.surface.faces);
  const seamless::EqualizationSystem system =
      seamless::equalization_system(cut, seamless::cut_segments(cut, adjacency));
  EXPECT_TRUE(ones_are_in_kernel(system));
  const bool fourfold = std::all_of(cones.begin(), cones.end(), [](Index k) { return k % 4 == 0; });
  if (!fourfold) {
    EXPECT_EQ(rank_of(system, true), static_cast<Index>(system.rows.size()));
  }
  EXPECT_EQ(cut.extra_path == kInvalid, cut.flat_sectors.empty());
  return judge.corner_counts();
}

inline std::multiset<Index> expect_good_cut(const mesh::Surface& surface,
                                            const std::vector<Index>& cones) {
  ExecutionContext context;
  return expect_good_cut(seamless::make_admissible_cut(surface, cones, context), surface, cones);
}

}  // namespace flipfree::test
