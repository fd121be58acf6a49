#include "flipfree/holonomy/needed_topology.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/field/compute.h"
#include "flipfree/field/turning.h"
#include "support/shapes.h"

namespace flipfree::holonomy::needed_topology_test {
namespace {

NeededTopology needed(const mesh::Surface& surface, bool aligned) {
  ExecutionContext context;
  const auto field = field::compute_cross_field(surface, {}, context).field;
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  return needed_topology(surface, adjacency, field, aligned, context);
}

bool adds_up(const mesh::Surface& surface, const NeededTopology& topology) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  return field::satisfies_gauss_bonnet(surface.faces, adjacency, topology.cones);
}

TEST(NeededTopology, ARectangleHasFourCornersAndNoLoop) {
  const mesh::Surface sheet = test::grid(6, 4);
  const NeededTopology topology = needed(sheet, true);
  EXPECT_TRUE(topology.loops.empty());
  EXPECT_EQ(std::count(topology.cones.begin(), topology.cones.end(), 1), 4);
  EXPECT_TRUE(adds_up(sheet, topology));
}

TEST(NeededTopology, ATubeHasOneStripBetweenItsRimsThatDoesNotTurn) {
  const mesh::Surface tube = test::cylinder(12, 5);
  const NeededTopology topology = needed(tube, true);
  ASSERT_EQ(topology.loops.size(), 1U);
  EXPECT_TRUE(topology.loops[0].between_boundaries);
  EXPECT_EQ(topology.loops[0].quarter_turns, 0);
  EXPECT_TRUE(needed(tube, false).loops.empty());
  EXPECT_TRUE(adds_up(tube, topology));
}

TEST(NeededTopology, CornersOfNoAngleAreEvenedOut) {
  // A kite with a tip of 20 degrees.
  mesh::Surface kite;
  kite.vertices.resize(4, 3);
  kite.vertices << 0.0, 0.0, 0.0, 3.0, -0.5, 0.0, 3.5, 0.0, 0.0, 3.0, 0.5, 0.0;
  kite.faces.resize(2, 3);
  kite.faces << 0, 1, 2, 0, 2, 3;
  const NeededTopology topology = needed(kite, true);
  EXPECT_TRUE(adds_up(kite, topology));
  EXPECT_GE(*std::min_element(topology.cones.begin(), topology.cones.end()), 1);
}

}  // namespace
}  // namespace flipfree::holonomy::needed_topology_test
