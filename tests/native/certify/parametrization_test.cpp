#include "flipfree/certify/parametrization.h"

#include <gtest/gtest.h>

#include "flipfree/certify/measures.h"
#include "support/shapes.h"

namespace flipfree::certify::parametrization_test {
namespace {

TEST(IdentityProvenance, places_every_vertex_at_itself) {
  for (const mesh::Surface& surface :
       {test::bumpy_grid(4, 3, 0.3, 2.0), test::torus(6, 5), test::tetrahedron()}) {
    Parametrization map;
    map.surface = surface;
    map.parent_face = {9, 9, 9};  // of another map
    map.vertex_parent = {9};
    set_identity_provenance(map);
    for (FaceId f = 0; f < surface.faces.rows(); ++f)
      EXPECT_EQ(map.parent_face.at(static_cast<std::size_t>(f)), f);
    for (VertexId v = 0; v < surface.vertices.rows(); ++v) {
      const FaceId f = map.vertex_parent.at(static_cast<std::size_t>(v));
      Vector3 place = Vector3::Zero();
      for (Index k = 0; k < 3; ++k)
        place += map.vertex_barycentric(v, k) * surface.vertices.row(surface.faces(f, k));
      EXPECT_EQ(place, surface.vertices.row(v).transpose());
    }
    EXPECT_EQ(check_provenance(surface, {&surface, &map.parent_face, &map.vertex_parent,
                                         &map.vertex_barycentric})
                  .failures,
              0);
  }
}

TEST(IdentityProvenance, isolated_vertices_lie_in_no_face) {
  Parametrization map;
  map.surface = test::grid(2, 2);
  map.surface.vertices.conservativeResize(11, 3);
  map.surface.vertices.bottomRows<2>().setOnes();
  set_identity_provenance(map);
  for (const VertexId v : {9, 10}) {
    EXPECT_EQ(map.vertex_parent.at(static_cast<std::size_t>(v)), kInvalid);
    EXPECT_TRUE(map.vertex_barycentric.row(v).isZero(0.0));
  }
  EXPECT_EQ(map.vertex_parent.size(), 11U);
}

}  // namespace
}  // namespace flipfree::certify::parametrization_test
