#include "flipfree/intrinsic/intrinsic_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "support/shapes.h"

namespace flipfree::intrinsic::intrinsic_mesh_test {
namespace {

IntrinsicSetup setup_of(const mesh::Surface& surface) {
  return build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
}

TEST(IntrinsicMesh, ADoubleCoverHasEveryFaceTwiceAndTheBoundaryOnce) {
  const mesh::Surface surface = test::grid(4, 3);
  const IntrinsicSetup setup = setup_of(surface);
  const IntrinsicMesh& mesh = setup.mesh;
  EXPECT_EQ(find_broken_invariant(mesh), "");
  ASSERT_TRUE(mesh.symmetric());
  EXPECT_EQ(mesh.face_count(), 2u * 24u);
  EXPECT_EQ(mesh.vertex_count(), 2u * 20u - 14u);
  // A sphere: closed, of Euler characteristic 2.
  EXPECT_EQ(mesh.vertex_count() + mesh.face_count(), mesh.edge_count() + 2u);
  EXPECT_EQ(std::count(setup.on_boundary.begin(), setup.on_boundary.end(), true), 14);
}

TEST(IntrinsicMesh, AClosedSurfaceIsItself) {
  const mesh::Surface surface = test::torus(6, 5);
  const IntrinsicSetup setup = setup_of(surface);
  EXPECT_FALSE(setup.mesh.symmetric());
  EXPECT_EQ(find_broken_invariant(setup.mesh), "");
  for (CornerId c = 0; c < 3 * static_cast<Index>(surface.faces.rows()); ++c) {
    const HalfedgeId h = setup.input_halfedge[static_cast<std::size_t>(c)];
    EXPECT_EQ(setup.mesh.origin_of(h), surface.faces(c / 3, c % 3));
    EXPECT_EQ(setup.mesh.face[static_cast<std::size_t>(h)], c / 3);
  }
}

TEST(IntrinsicMesh, FlipsKeepFacesAndWhatNamesThem) {
  IntrinsicMesh mesh = setup_of(test::sphere(7, 5)).mesh;
  for (EdgeId e = 0; static_cast<std::size_t>(e) < mesh.edge_count(); e += 3) {
    if (is_glued_to_itself(mesh, e)) continue;
    const std::pair faces{mesh.face[at(2 * e)], mesh.face[at(2 * e + 1)]};
    flip_edge(mesh, e);
    EXPECT_EQ(find_broken_invariant(mesh), "");
    EXPECT_EQ(mesh.face_halfedge[at(faces.first)], 2 * e);
    EXPECT_EQ(mesh.face_halfedge[at(faces.second)], 2 * e + 1);
  }
}

TEST(IntrinsicMesh, ABrokenReflectionLabelOrFaceIsFound) {
  const IntrinsicMesh good = setup_of(test::grid(3, 3)).mesh;
  IntrinsicMesh mesh = good;
  std::swap(mesh.reflection[0], mesh.reflection[2]);
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  mesh.edge_label[0] = mesh.edge_label[0] == EdgeLabel::kOne ? EdgeLabel::kTwo : EdgeLabel::kOne;
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  mesh.face_label[0] = FaceLabel::kQuad;
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  mesh.face_halfedge[0] = mesh.face_halfedge[1];
  EXPECT_NE(find_broken_invariant(mesh), "");
}

}  // namespace
}  // namespace flipfree::intrinsic::intrinsic_mesh_test
