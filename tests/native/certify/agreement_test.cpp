#include "flipfree/certify/agreement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/shapes.h"

namespace flipfree::certify {
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

TEST(Agreement, stored_values_that_do_not_pass_alone_are_said_to_fail) {
  Parametrization map = stored_map();
  map.certificate.ok = true;
  map.uv32.row(0) = map.uv32.row(1);  // a collapsed face
  agree_with_storage(map, request_of(map), ExecutionContext());
  EXPECT_FALSE(map.certificate.ok);
}

}  // namespace
}  // namespace flipfree::certify
