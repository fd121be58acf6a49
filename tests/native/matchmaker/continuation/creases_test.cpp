#include "flipfree/matchmaker/continuation/creases.h"

#include <gtest/gtest.h>

#include "flipfree/base/plane.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::creases_test {
namespace {

using Place = Creases::Place;

// A coarse disk of a warped grid, two of its edges split, moved by an affine map.
class Affine : public testing::Test {
 protected:
  Affine() : surface_(test::warped_grid(16)), fine_(test::identity_map(surface_)) {
    std::vector<char> keep(fine_.surface.position.size(), 0);
    for (const VertexId b : fine_.surface.boundary) keep[static_cast<std::size_t>(b)] = 1;
    ExecutionContext context;
    disk_ = decimate(fine_, keep, 110, context);
    coarse_.surface = mesh::make_refined_surface(disk_.surface);
    mesh::EditableTriangulation& mesh = coarse_.surface.mesh;
    for (int splits = 0; splits < 2; ++splits) {
      HalfedgeId h = 40 * splits;
      while (mesh.is_boundary(h)) ++h;
      coarse_.surface.split_edge(h);
    }
    coarse_.uv.resize(mesh.vertex_count(), 2);
    for (VertexId v = 0; v < mesh.vertex_count(); ++v)
      coarse_.uv.row(v) = change(before(v)).transpose();
  }

  // Determinant 6.5.
  static Vector2 change(const Vector2& p) {
    return {2 * p.x() - p.y() + 1, 0.5 * p.x() + 3 * p.y()};
  }
  // Where a vertex of the refined coarse surface lies in the fine map.
  Vector2 before(VertexId v) const {
    Vector2 p = Vector2::Zero();
    const mesh::Support& s = coarse_.surface.support[static_cast<std::size_t>(v)];
    for (std::size_t i = 0; i < 3 && s.vertex[i] != kInvalid; ++i)
      p += s.weight[i] *
           Vector2(fine_.uv.row(disk_.fine[static_cast<std::size_t>(s.vertex[i])]).transpose());
    return p;
  }

  mesh::Surface surface_;
  mesh::RefinedMap fine_;
  CoarseDisk disk_;
  mesh::RefinedMap coarse_;
};

TEST_F(Affine, EveryFineVertexIsLocatedAndMovedAsTheMapMoves) {
  const Creases creases(coarse_, disk_, fine_.uv);
  ASSERT_TRUE(creases.valid());
  for (std::size_t v = 0; v < disk_.face.size(); ++v) {
    if (disk_.face[v] == kInvalid) continue;
    const Vector2 p = fine_.uv.row(static_cast<Eigen::Index>(v)).transpose();
    const Place place = creases.locate(disk_.face[v], p);
    EXPECT_LT((creases.moved(place, p) - change(p)).norm(), 1e-12);
    EXPECT_NEAR(creases.least_stretch(place), 6.5, 1e-9);
  }
}

TEST_F(Affine, PointsOnEdgesAndAtVerticesAreKnownAsSuch) {
  const Creases creases(coarse_, disk_, fine_.uv);
  const mesh::EditableTriangulation& mesh = creases.mesh();
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (!mesh.alive(f)) continue;
    const auto c = mesh.corners(f);
    const Place corner = creases.locate(mesh.parent(f), creases.before(c[0]));
    EXPECT_EQ(corner.kind, Place::Kind::kVertex);
    EXPECT_EQ(corner.id, c[0]);
    EXPECT_EQ(creases.moved(corner, creases.before(c[0])), creases.after(c[0]));
    const Vector2 middle =
        (creases.before(c[0]) + creases.before(c[1]) + creases.before(c[2])) / 3.0;
    const Place inside = creases.locate(mesh.parent(f), middle);
    EXPECT_EQ(inside.kind, Place::Kind::kFace);
    EXPECT_EQ(inside.id, f);
    int faces = 0;
    creases.for_each_face(corner, [&](FaceId) { ++faces; });
    EXPECT_EQ(faces, static_cast<int>(mesh.star(c[0]).size()));
  }
  // On an edge between grid points whose middle is exact.
  const Place place{Place::Kind::kEdge, mesh.edge(0)};
  const Vector2 a = creases.before(mesh.source(place.id)),
                b = creases.before(mesh.target(place.id));
  const Vector2 p = a + 0.25 * (b - a);
  EXPECT_LT((creases.moved(place, p) - change(p)).norm(), 1e-12);
}

TEST_F(Affine, TrianglesMeetAFaceWhereTheirInsidesOverlap) {
  const Creases creases(coarse_, disk_, fine_.uv);
  const mesh::EditableTriangulation& mesh = creases.mesh();
  const auto triangle = [&](FaceId f) -> std::array<Vector2, 3> {
    const auto c = mesh.corners(f);
    return {creases.before(c[0]), creases.before(c[1]), creases.before(c[2])};
  };
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    for (FaceId g = 0; g < mesh.face_slots(); g += 3) {
      if (!mesh.alive(f) || !mesh.alive(g)) continue;
      EXPECT_EQ(creases.meets(f, triangle(g)), f == g) << f << " " << g;
    }
  }
  std::array<Vector2, 3> wide = triangle(0);
  const Vector2 middle = (wide[0] + wide[1] + wide[2]) / 3.0;
  for (Vector2& p : wide) p += 1e-3 * (p - middle);
  for (HalfedgeId h = 0; h < 3; ++h) {
    if (mesh.is_boundary(h)) continue;
    EXPECT_TRUE(creases.meets(mesh.opposite(h) / 3, wide));
  }
}

TEST_F(Affine, AFaceThatIsTurnedOverIsNoticed) {
  CoarseDisk broken = disk_;
  std::swap(broken.fine[disk_.surface.faces(0, 0) == 0 ? 0U : 1U], broken.fine.back());
  EXPECT_FALSE(Creases(coarse_, broken, fine_.uv).valid());
}

}  // namespace
}  // namespace flipfree::matchmaker::creases_test
