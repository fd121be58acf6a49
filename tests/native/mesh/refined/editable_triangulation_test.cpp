#include "flipfree/mesh/refined/editable_triangulation.h"

#include <gtest/gtest.h>

#include <array>

#include "support/shapes.h"

namespace flipfree::mesh::editable_triangulation_test {
namespace {

EditableTriangulation grid(Index columns, Index rows) {
  const Surface surface = test::grid(columns, rows);
  return {static_cast<Index>(surface.vertices.rows()), surface.faces};
}

TEST(EditableTriangulation, SplittingEveryEdgeKeepsADiskAndHandsMarksOn) {
  EditableTriangulation mesh = grid(4, 3);
  std::vector<std::array<VertexId, 2>> edges;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    mesh.set_mark(h, 7);
    if (mesh.edge(h) == h) edges.push_back({mesh.source(h), mesh.target(h)});
  }
  const Index vertices = mesh.vertex_count();
  const Index faces = mesh.face_slots();
  Index expected_faces = faces;
  for (const auto& [a, b] : edges) {
    const HalfedgeId h = mesh.find(a, b);
    expected_faces += mesh.is_boundary(h) ? 1 : 2;
    const VertexId s = mesh.split_edge(h);
    mesh.check_invariants();
    EXPECT_EQ(mesh.mark(mesh.find(a, s)), 7);
    EXPECT_EQ(mesh.mark(mesh.find(s, b)), 7);
    EXPECT_EQ(mesh.find(a, b), kInvalid);
  }
  EXPECT_EQ(mesh.vertex_count(), vertices + static_cast<Index>(edges.size()));
  EXPECT_EQ(mesh.faces().rows(), expected_faces);
}

TEST(EditableTriangulation, FlippingTwiceRestoresTheEdge) {
  EditableTriangulation mesh = grid(3, 3);
  for (HalfedgeId first = 0; first < mesh.halfedge_slots(); ++first) {
    if (mesh.is_boundary(first)) continue;
    const VertexId a = mesh.source(first);
    const VertexId b = mesh.target(first);
    const VertexId c = mesh.apex(first);
    const VertexId d = mesh.apex(mesh.opposite(first));
    if (mesh.find(c, d) != kInvalid) continue;
    mesh.flip_edge(mesh.find(a, b));
    mesh.check_invariants();
    EXPECT_EQ(mesh.find(a, b), kInvalid);
    mesh.flip_edge(mesh.find(c, d));
    mesh.check_invariants();
    EXPECT_NE(mesh.find(a, b), kInvalid);
  }
}

TEST(EditableTriangulation, SplittingAFaceAndReplacingItsStarRestoresTheFace) {
  EditableTriangulation mesh = grid(3, 2);
  for (FaceId f = 0; f < 12; ++f) {
    const EditableTriangulation::Triangle corners = mesh.corners(f);
    const VertexId s = mesh.split_face(f);
    mesh.check_invariants();
    const std::vector<FaceId> star = mesh.star(s);
    ASSERT_EQ(star.size(), 3U);
    const std::array<EditableTriangulation::Triangle, 1> triangle = {corners};
    const std::array<FaceId, 1> parent = {mesh.parent(star[0])};
    mesh.replace(star, triangle, parent);
    mesh.check_invariants();
    EXPECT_EQ(mesh.outgoing(s), kInvalid);
  }
  EXPECT_EQ(mesh.faces().rows(), 12);
}

}  // namespace
}  // namespace flipfree::mesh::editable_triangulation_test
