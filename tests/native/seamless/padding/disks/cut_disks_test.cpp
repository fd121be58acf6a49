// Pieces of a cut, each with its metric.
#include "flipfree/seamless/padding/disks/cut_disks.h"

#include <gtest/gtest.h>

#include "flipfree/mesh/topology.h"
#include "seamless/padding/geometry/hand_cuts.h"

namespace flipfree::seamless::cut_disks_test {
namespace {

TEST(CutDisks, EveryComponentIsADiskWithAMetric) {
  const test::ConedCut cut = test::digon_cut();
  const mesh::Adjacency adjacency = test::adjacency_of(cut.cut);
  ExecutionContext context;
  const auto disks =
      solve_disks(cut.cut, adjacency, cut_segments(cut.cut, adjacency), cut.cones, context);
  ASSERT_EQ(disks.size(), 2u);
  Eigen::Index faces = 0;
  for (const CutDisk& disk : disks) {
    faces += disk.chart.surface.faces.rows();
    const auto of_chart = mesh::build_adjacency(
        static_cast<Index>(disk.chart.surface.vertices.rows()), disk.chart.surface.faces);
    EXPECT_TRUE(mesh::topology(disk.chart.surface.faces, of_chart).is_disk());
    EXPECT_GT(disk.iterations, 0);
  }
  EXPECT_EQ(faces, cut.cut.surface.faces.rows());
}

}  // namespace
}  // namespace flipfree::seamless::cut_disks_test
