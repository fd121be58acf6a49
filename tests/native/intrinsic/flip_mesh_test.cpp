#include "flipfree/intrinsic/flip_mesh.h"

#include <gtest/gtest.h>

#include <utility>

#include "support/flip_meshes.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::flip_mesh_test {
namespace {

TEST(FlipMesh, TwoFlipsReverseAnEdgeAndFourGiveItBack) {
  const FlipMesh before = test::closed_mesh(test::sphere(6, 4));
  FlipMesh mesh = before;
  for (EdgeId e = 0; at(e) < mesh.edge_count(); ++e) {
    flip_edge(mesh, e);
    EXPECT_EQ(find_broken_invariant(mesh), "");
    flip_edge(mesh, e);
    EXPECT_EQ(mesh.origin_of(2 * e), before.target(2 * e));
    EXPECT_EQ(mesh.origin_of(2 * e + 1), before.origin_of(2 * e));
    flip_edge(mesh, e);
    flip_edge(mesh, e);
    EXPECT_EQ(mesh.next, before.next);
    EXPECT_EQ(mesh.origin, before.origin);
  }
}

TEST(FlipMesh, AFaceIsGluedToItselfAroundAVertexOfValenceOne) {
  FlipMesh mesh = test::closed_mesh(test::tetrahedron());
  // The edges out of one vertex, but for the last.
  HalfedgeId h = 0;
  const VertexId v = mesh.origin_of(h);
  for (int left = 3; left > 1; --left) {
    const HalfedgeId next = mesh.rotate_ccw(h);
    EXPECT_FALSE(is_glued_to_itself(mesh, FlipMesh::edge(h)));
    flip_edge(mesh, FlipMesh::edge(h));
    h = next;
  }
  EXPECT_EQ(mesh.origin_of(h), v);
  EXPECT_EQ(mesh.rotate_ccw(h), h);
  EXPECT_TRUE(is_glued_to_itself(mesh, FlipMesh::edge(h)));
  EXPECT_EQ(find_broken_invariant(mesh), "");
  EXPECT_EQ(count_vertices(mesh), 4);
}

TEST(FlipMesh, BrokenArraysAreFound) {
  const FlipMesh good = test::closed_mesh(test::torus(5, 4));
  FlipMesh mesh = good;
  mesh.next[3] = static_cast<HalfedgeId>(mesh.halfedge_count());
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  std::swap(mesh.next[3], mesh.next[10]);
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  mesh.origin[7] = mesh.origin[7] == 0 ? 1 : 0;
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  mesh.origin.pop_back();
  EXPECT_NE(find_broken_invariant(mesh), "");
}

}  // namespace
}  // namespace flipfree::intrinsic::flip_mesh_test
