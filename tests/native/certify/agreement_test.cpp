
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/certify/certified_map.h"
#include "support/shapes.h"

namespace flipfree::certify::agreement_test {
namespace {

Parametrization stored_map() {
  Parametrization map;
  map.surface = test::grid(3, 3);
  map.uv.resize(3 * map.surface.faces.rows(), 2);
  for (CornerId c = 0; c < map.uv.rows(); ++c)
    map.uv.row(c) = map.surface.vertices.row(map.surface.faces(c / 3, c % 3)).leftCols<2>();
  map.uv32 = map.uv.cast<float>();
  set_identity_provenance(map);
  return map;
}

CertifyRequest request_of(const Parametrization& map) {
  CertifyRequest request;
  request.surface = &map.surface;
  request.uv = &map.uv;
  request.uv32 = &map.uv32;
  return request;
}

TEST(Agreement, nothing_is_kept_beside_a_map_that_rounds_to_what_is_stored) {
  Parametrization map = stored_map();
  agree_with_storage(map, request_of(map), ExecutionContext());
  EXPECT_EQ(map.agreed.rows(), 0);
}

TEST(Agreement, only_what_was_repaired_is_taken_from_storage_unless_angles_are_prescribed) {
  for (const bool angles : {false, true}) {
    Parametrization map = stored_map();
    for (CornerId c = 0; c < map.uv.rows(); ++c) {
      if (map.surface.faces(c / 3, c % 3) == 5)
        map.uv32(c, 0) = std::nextafter(map.uv32(c, 0), 1.0F);
    }
    CertifyRequest request = request_of(map);
    if (angles) request.cone_angles = {{5, 2.0 * std::numbers::pi}};
    agree_with_storage(map, request, ExecutionContext());
    ASSERT_EQ(map.agreed.rows(), map.uv.rows());
    EXPECT_EQ(Points2f(map.agreed.cast<float>()), map.uv32);
    for (CornerId c = 0; c < map.uv.rows(); ++c) {
      const bool repaired = map.surface.faces(c / 3, c % 3) == 5;
      const Points2 expected =
          repaired || angles ? Points2(map.uv32.row(c).cast<double>()) : Points2(map.uv.row(c));
      EXPECT_EQ(Points2(map.agreed.row(c)), expected) << "corner " << c;
    }
  }
}

// The triangle's long side passes the stored corner where it is in 64 bits, not where it is stored.
TEST(Agreement, stored_values_are_taken_alone_where_they_pass_only_together) {
  const double unit = std::ldexp(1.0, -23);  // of 32-bit floats above 1
  Parametrization map;
  map.surface.vertices.resize(3, 3);
  map.surface.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  map.surface.faces = Triangles{{0, 1, 2}};
  map.uv.resize(3, 2);
  map.uv << -1, 1 + 0.2 * unit, 1, -1 + 0.2 * unit, 0, 0.3 * unit;
  map.uv32 = map.uv.cast<float>();
  map.uv32(2, 1) = static_cast<float>(0.1 * unit);
  set_identity_provenance(map);
  certify_map(map, map.surface, {}, ExecutionContext());
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(map.agreed, Points2(map.uv32.cast<double>()));
}

TEST(Agreement, stored_values_that_do_not_pass_alone_are_said_to_fail) {
  Parametrization map = stored_map();
  map.certificate.ok = true;
  map.uv32.row(0) = map.uv32.row(1);  // a collapsed face
  agree_with_storage(map, request_of(map), ExecutionContext());
  EXPECT_FALSE(map.certificate.ok);
}

}  // namespace
}  // namespace flipfree::certify::agreement_test
