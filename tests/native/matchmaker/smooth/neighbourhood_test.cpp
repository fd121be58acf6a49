#include "flipfree/matchmaker/smooth/neighbourhood.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::neighbourhood_test {
namespace {

TEST(Neighbourhood, GrowsByRings) {
  const mesh::Surface surface = test::grid(10, 10);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  const VertexId centre = 11 * 5 + 5;
  EXPECT_EQ(vertices_near(refined.mesh, {centre, centre}, 0), std::vector<VertexId>{centre});
  const std::vector<VertexId> one = vertices_near(refined.mesh, {centre}, 1);
  EXPECT_EQ(one.size(), refined.mesh.star(centre).size() + 1);
  EXPECT_TRUE(std::is_sorted(one.begin(), one.end()));
  const std::vector<VertexId> two = vertices_near(refined.mesh, {centre}, 2);
  EXPECT_TRUE(std::includes(two.begin(), two.end(), one.begin(), one.end()));
  EXPECT_EQ(faces_at(refined.mesh, {centre}).size(), refined.mesh.star(centre).size());
}

TEST(Neighbourhood, APatchIsThePartOfTheMapWithNumbersOfItsOwn) {
  const mesh::Surface surface = test::bumpy_grid(6, 6, 0.2, 2);
  const mesh::RefinedMap map = test::identity_map(surface);
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  for (const FaceId f : faces_at(map.surface.mesh, {24}))
    triangles.push_back(map.surface.mesh.corners(f));
  const Patch patch = make_patch(map, triangles);
  ASSERT_EQ(patch.surface.faces.rows(), static_cast<Eigen::Index>(triangles.size()));
  for (Eigen::Index f = 0; f < patch.surface.faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      const VertexId local = patch.surface.faces(f, k);
      const VertexId v = patch.vertices[static_cast<std::size_t>(local)];
      EXPECT_EQ(v, triangles[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)]);
      EXPECT_EQ(patch.uv.row(local), map.uv.row(v));
      EXPECT_EQ(patch.surface.vertices.row(local), surface.vertices.row(v));
    }
  }
}

// All triangles positive, and yet twice around.
TEST(Neighbourhood, SeesAVertexThatWindsTwice) {
  mesh::Surface fan;
  constexpr Index kSides = 9;
  fan.vertices.resize(kSides + 1, 3);
  fan.faces.resize(kSides, 3);
  fan.vertices.row(0).setZero();
  Points2 twice = Points2::Zero(kSides + 1, 2);
  for (Index i = 0; i < kSides; ++i) {
    const double angle = 2 * std::acos(-1.0) * i / kSides;
    fan.vertices.row(i + 1) << std::cos(angle), std::sin(angle), 0.0;
    twice.row(i + 1) << std::cos(2 * angle), std::sin(2 * angle);
    fan.faces.row(i) << 0, i + 1, (i + 1) % kSides + 1;
  }
  const mesh::RefinedMap map = test::identity_map(fan);
  std::vector<VertexId> all;
  std::vector<FaceId> faces;
  for (Index v = 0; v <= kSides; ++v) all.push_back(v);
  for (Index f = 0; f < kSides; ++f) faces.push_back(f);
  EXPECT_FALSE(winds_more(map, all, fan.faces, map.uv, faces));
  EXPECT_TRUE(winds_more(map, all, fan.faces, twice, faces));
}

}  // namespace
}  // namespace flipfree::matchmaker::neighbourhood_test
