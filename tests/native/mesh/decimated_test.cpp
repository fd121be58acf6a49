#include "flipfree/mesh/decimated/decimated.h"

#include <gtest/gtest.h>

#include "flipfree/mesh/topology.h"
#include "support/shapes.h"

namespace flipfree::mesh::decimated_test {
namespace {

Topology shape_of(const Surface& surface) {
  return topology(surface.faces,
                  build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces));
}

TEST(Decimated, has_few_faces_and_the_same_topology) {
  for (const Surface& surface :
       {test::sphere(40, 30), test::torus(40, 30), test::cylinder(40, 30), test::grid(40, 30)}) {
    ExecutionContext context;
    const Decimated few = decimate(surface, 300, context);
    EXPECT_LE(few.surface.faces.rows(), 300);
    const Topology before = shape_of(surface);
    const Topology after = shape_of(few.surface);
    EXPECT_EQ(after.euler(), before.euler());
    EXPECT_EQ(after.boundary_loops, before.boundary_loops);
    EXPECT_EQ(after.components, 1);
  }
}

}  // namespace
}  // namespace flipfree::mesh::decimated_test
