#include "flipfree/mesh/topology.h"

#include <gtest/gtest.h>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::mesh::topology_test {
namespace {

using test::adjacency_of;

Topology topology_of(const Surface& surface) {
  return topology(surface.faces, adjacency_of(surface));
}

TEST(Topology, counts_loops_genus_and_components) {
  const Topology disk = topology_of(test::grid(3, 3));
  EXPECT_TRUE(disk.is_disk());
  EXPECT_EQ(disk.genus(), 0);
  const Topology sphere = topology_of(test::sphere(8, 6));
  EXPECT_EQ(sphere.boundary_loops, 0);
  EXPECT_EQ(sphere.genus(), 0);
  EXPECT_EQ(sphere.euler(), 2);
  const Topology torus = topology_of(test::torus(8, 6));
  EXPECT_EQ(torus.genus(), 1);
  const Topology tube = topology_of(test::cylinder(8, 2));
  EXPECT_EQ(tube.boundary_loops, 2);
  EXPECT_EQ(tube.genus(), 0);
}

TEST(BoundaryLoops, run_with_the_surface_on_the_left) {
  const Surface surface = test::grid(2, 1);
  const auto loops = boundary_loops(surface.faces, adjacency_of(surface));
  ASSERT_EQ(loops.size(), 1U);
  EXPECT_EQ(loops[0], (std::vector<VertexId>{0, 1, 2, 5, 4, 3}));
}

TEST(FaceComponents, are_numbered_by_their_smallest_face) {
  // Two tetrahedra whose faces take turns, and a triangle.
  const Surface one = test::tetrahedron();
  Triangles faces(9, 3);
  for (Index f = 0; f < 4; ++f) {
    faces.row(2 * f) = one.faces.row(f).array() + 4;
    faces.row(2 * f + 1) = one.faces.row(f);
  }
  faces.row(8) << 8, 9, 10;
  const Components components = face_components(build_adjacency(11, faces));
  EXPECT_EQ(components.count, 3);
  EXPECT_EQ(components.of_face, (std::vector<Index>{0, 1, 0, 1, 0, 1, 0, 1, 2}));
}

}  // namespace
}  // namespace flipfree::mesh::topology_test
