#include "flipfree/mesh/decimated/decimated.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

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

TEST(Decimated, stays_near_the_surface) {
  ExecutionContext context;
  const Decimated few = decimate(test::sphere(80, 60), 400, context);
  for (Eigen::Index f = 0; f < few.surface.faces.rows(); ++f) {
    Vector3 middle = Vector3::Zero();
    for (Index k = 0; k < 3; ++k)
      middle += few.surface.vertices.row(few.surface.faces(f, k)).transpose() / 3.0;
    EXPECT_GT(middle.norm(), 0.95);
  }
}

TEST(Decimated, every_vertex_went_into_a_neighbourhood_that_the_few_know) {
  const Surface surface = test::torus(40, 30);
  ExecutionContext context;
  const Decimated few = decimate(surface, 300, context);
  for (std::size_t i = 0; i < few.origin.size(); ++i) {
    const VertexId v = few.origin[i];
    EXPECT_EQ(few.into[static_cast<std::size_t>(v)], static_cast<VertexId>(i));
    EXPECT_EQ(few.surface.vertices.row(static_cast<Eigen::Index>(i)), surface.vertices.row(v));
  }
  // Where two of the few are neighbours, so are two that went into them.
  std::set<std::pair<VertexId, VertexId>> met;
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      met.emplace(few.into[static_cast<std::size_t>(surface.faces(f, k))],
                  few.into[static_cast<std::size_t>(surface.faces(f, (k + 1) % 3))]);
    }
  }
  for (Eigen::Index f = 0; f < few.surface.faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      EXPECT_TRUE(met.contains({few.surface.faces(f, k), few.surface.faces(f, (k + 1) % 3)}));
    }
  }
}

TEST(Decimated, the_smallest_closed_surface_stays) {
  ExecutionContext context;
  EXPECT_EQ(decimate(test::tetrahedron(), 1, context).surface.faces.rows(), 4);
}

TEST(Decimated, is_the_same_for_any_number_of_threads) {
  ExecutionContext one;
  one.threads = 1;
  ExecutionContext four;
  four.threads = 4;
  const Surface surface = test::sphere(120, 100);
  EXPECT_EQ(decimate(surface, 500, one).origin, decimate(surface, 500, four).origin);
}

}  // namespace
}  // namespace flipfree::mesh::decimated_test
