#include "flipfree/conformal/map/stored_map.h"

#include <gtest/gtest.h>

#include <numbers>

#include "flipfree/numeric/predicates.h"
#include "support/shapes.h"

namespace flipfree::conformal::stored_map_test {
namespace {

using std::numbers::pi;

intrinsic::MetricLayout flat_layout(const mesh::Surface& surface) {
  intrinsic::MetricLayout layout;
  layout.map.surface = surface;
  layout.map.uv.resize(3 * surface.faces.rows(), 2);
  layout.map.provenance.vertex.resize(static_cast<std::size_t>(surface.vertices.rows()));
  for (CornerId c = 0; c < 3 * static_cast<Index>(surface.faces.rows()); ++c) {
    const VertexId v = surface.faces(c / 3, c % 3);
    layout.map.uv.row(c) = surface.vertices.row(v).head<2>();
    layout.map.provenance.vertex[static_cast<std::size_t>(v)] = {c / 3, Vector3::Unit(c % 3)};
    if (c % 3 == 0) layout.map.provenance.face.push_back(c / 3);
  }
  return layout;
}

TEST(StoredMap, HasTheLayoutsProvenanceAndTheNearest32BitValues) {
  const mesh::Surface surface = test::grid(3, 3);
  intrinsic::MetricLayout layout = flat_layout(surface);
  certify::Parametrization map;
  take_map(layout, map);
  EXPECT_EQ(map.surface.faces, surface.faces);
  EXPECT_EQ(map.uv32, map.uv.cast<float>());
  for (Index v = 0; v < static_cast<Index>(surface.vertices.rows()); ++v) {
    Vector3 place = Vector3::Zero();
    for (Index k = 0; k < 3; ++k)
      place +=
          map.vertex_barycentric(v, k) *
          surface.vertices.row(surface.faces(map.vertex_parent[static_cast<std::size_t>(v)], k))
              .transpose();
    EXPECT_EQ(place, Vector3(surface.vertices.row(v).transpose()));
  }
}

TEST(StoredMap, AngleErrorIsThatOfTheWorstVertexAsked) {
  certify::Parametrization map;
  intrinsic::MetricLayout layout = flat_layout(test::grid(2, 2));
  take_map(layout, map);
  EXPECT_NEAR(stored_angle_error(map, {{4, 2.0 * pi}, {0, 0.5 * pi}}), 0.0, 1e-6);
  EXPECT_NEAR(stored_angle_error(map, {{4, 2.0 * pi}, {1, 0.75 * pi}}), 0.25 * pi, 1e-6);
}

TEST(StoredMap, ATriangleThatTheNearest32BitValuesMakeFlatIsRoundedOtherwise) {
  mesh::Surface surface;
  surface.vertices.resize(3, 3);
  surface.vertices << 0, 0, 0, 2, 0, 0, 1, 0.4, 0;
  surface.faces.resize(1, 3);
  surface.faces << 0, 1, 2;
  intrinsic::MetricLayout layout = flat_layout(surface);
  // In steps of the 32-bit values there.
  layout.map.uv *= 0x1p-24;
  layout.map.uv.array() += 0.75;
  certify::Parametrization map;
  take_map(layout, map);
  const auto is_positive = [&] {
    const auto corner = [&](Index k) { return Vector2(map.uv32.row(k).cast<double>()); };
    return numeric::orientation(corner(0), corner(1), corner(2)) > 0;
  };
  ASSERT_FALSE(is_positive());
  ExecutionContext context;
  EXPECT_TRUE(repair_rounding(map, context));
  EXPECT_TRUE(is_positive());
}

}  // namespace
}  // namespace flipfree::conformal::stored_map_test
