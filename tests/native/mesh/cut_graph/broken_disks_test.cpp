#include <gtest/gtest.h>

#include "flipfree/mesh/cut_graph/map_cut.h"
#include "support/shapes.h"

namespace flipfree::mesh::broken_disks_test {
namespace {

TEST(FindBrokenDisks, NamesConesOffTheCutAndPiecesThatAreNoDisks) {
  const Surface surface = test::torus(6, 5);
  const Adjacency adjacency =
      build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  EdgeFlags cut(adjacency.opposite.size(), 0);
  EXPECT_NE(find_broken_disks(surface, adjacency, cut, {}), "");
  EXPECT_NE(find_broken_disks(surface, adjacency, cut, {3}), "");
  cut[0] = 1;
  EXPECT_NE(find_broken_disks(surface, adjacency, cut, {}), "");
}

}  // namespace
}  // namespace flipfree::mesh::broken_disks_test
