#include "flipfree/certify/certify.h"
#include "flipfree/certify/certified_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify::certify_test {
namespace {

using test::corners;
using test::flat;
using test::measure;

TEST(Certify, figures_are_those_of_the_stored_map_where_it_is_worse) {
  const mesh::Surface surface = test::grid(6, 5);
  const Points2 uv = flat(surface);
  Points2 moved = surface.vertices.leftCols<2>();
  moved.row(8) += Eigen::RowVector2d(0.12, 0.0);
  const Points2f stored = corners(surface, moved).cast<float>();
  CertifyRequest request;
  request.surface = &surface;
  request.uv = &uv;
  request.uv32 = &stored;
  const Certificate c = certify(request, ExecutionContext());
  const Certificate worse = measure(surface, stored.cast<double>());
  EXPECT_TRUE(c.ok);
  EXPECT_GT(worse.max_energy, 1.5);
  EXPECT_EQ(c.energy, worse.energy);
  EXPECT_EQ(c.max_energy, worse.max_energy);
  EXPECT_EQ(c.energy_p99, worse.energy_p99);
}

TEST(Certify, a_triangle_that_only_rounding_to_32_bits_flips_is_found) {
  mesh::Surface surface;
  surface.vertices = Points3::Zero(3, 3);
  surface.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  surface.faces = Triangles(1, 3);
  surface.faces << 0, 1, 2;
  Points2 uv(3, 2);
  uv << 1.0, 1.0, 2.0, 1.0, 1.5, 1.0 + 1e-9;
  const Certificate c = measure(surface, uv);
  EXPECT_EQ(c.flips64, 0);
  EXPECT_EQ(c.flips32, 1);
  EXPECT_FALSE(c.ok);
}

TEST(Certify, a_strip_that_crosses_itself_is_counted_and_fails_only_if_bijectivity_is_asked_for) {
  // A strip bent by 1.5 turns on a circle: locally injective, globally not.
  const mesh::Surface surface = test::grid(60, 1);
  Points2 uv(surface.vertices.rows(), 2);
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const double angle = 3.0 * std::numbers::pi * surface.vertices(v, 0);
    const double radius = 2.0 - 0.2 * surface.vertices(v, 1);
    uv.row(v) << radius * std::cos(angle), radius * std::sin(angle);
  }
  EXPECT_TRUE(measure(surface, corners(surface, uv)).ok);
  EXPECT_GT(measure(surface, corners(surface, uv)).overlaps, 0);
  CertifyRequest bijective;
  bijective.require_bijective = true;
  EXPECT_FALSE(measure(surface, corners(surface, uv), bijective).ok);
}

// A unit square whose second triangle was cut off and moved by `turn` quarter turns and a
// translation.
Certificate moved_triangle(int turn, double dx) {
  const mesh::Surface surface = test::grid(1, 1);
  Points2 uv = flat(surface);
  for (CornerId c = 3; c < 6; ++c) {
    Vector2 p = uv.row(c);
    for (int k = 0; k < turn; ++k) p = Vector2(-p.y(), p.x());
    uv.row(c) << p.x() + dx, p.y() + 3.0;
  }
  CertifyRequest request;
  request.require_seamless = true;
  return measure(surface, uv, request);
}

TEST(Certify, seams_must_match_by_exact_quarter_turns_and_are_told_how_far_they_are_off) {
  for (int turn = 0; turn < 4; ++turn) {
    const Certificate exact = moved_triangle(turn, 5.0);
    EXPECT_EQ(exact.seam_failures, 0);
    EXPECT_EQ(exact.seams_exact64, 1);
    EXPECT_EQ(exact.seams_exact32, 1);
    ASSERT_EQ(exact.seams.size(), 1U);
    EXPECT_EQ(exact.seams[0].quarter_turns, turn);
    EXPECT_EQ(exact.seams[0].translation, Vector2(5.0, 3.0));
  }
  // A translation that rounds the difference across the seam by one unit in the last place.
  const Certificate off = moved_triangle(0, 0.1);
  EXPECT_EQ(off.seam_failures, 1);
  EXPECT_EQ(off.seam_edges, 1);
  EXPECT_EQ(off.seams_exact64, 0);
  EXPECT_GT(off.seam_deviation, 0.0);
  EXPECT_LT(off.seam_deviation, 1e-15);
  const Certificate none = moved_triangle(0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(none.seams_exact64, 0);
  EXPECT_EQ(none.seams_exact32, 0);
  EXPECT_TRUE(std::isnan(none.seam_deviation));
  EXPECT_FALSE(none.ok);
}

// A pyramid of three right isosceles triangles around its top, unfolded: a cone of three quarter
// turns, cut open along one edge.
TEST(Certify, cones_of_seamless_maps_are_counted_exactly) {
  mesh::Surface surface;
  surface.vertices = (Points3(4, 3) << 0, 0, 1, 1, 0, 0, 0, 1, 0, -1, -1, 0).finished();
  surface.faces = (Triangles(3, 3) << 0, 1, 2, 0, 2, 3, 0, 3, 1).finished();
  Points2 uv(9, 2);
  uv << 0, 0, 2, 0, 0, 2, 0, 0, 0, 2, -2, 0, 0, 0, -2, 0, 0, -2;
  CertifyRequest request;
  request.require_seamless = true;
  const Certificate found = measure(surface, uv, request);
  EXPECT_TRUE(found.ok);
  ASSERT_EQ(found.quarter_cones.size(), 1U);
  EXPECT_EQ(found.quarter_cones[0], (std::pair<VertexId, Index>{0, 3}));
  request.cone_angles = {{0, 1.5 * std::numbers::pi}};
  EXPECT_TRUE(measure(surface, uv, request).ok);
  for (const double wrong : {2.0 * std::numbers::pi, 1.4 * std::numbers::pi}) {
    request.cone_angles = {{0, wrong}};
    EXPECT_EQ(measure(surface, uv, request).cone_failures, 1);
  }
}

// A grid whose first face (0, 1, 5) is split at its centroid.
Parametrization split_face(const mesh::Surface& parent) {
  Parametrization map;
  const Eigen::Index n = parent.vertices.rows();
  const Eigen::Index m = parent.faces.rows();
  map.surface.vertices.resize(n + 1, 3);
  map.surface.vertices.topRows(n) = parent.vertices;
  const auto corner = [&](Index k) { return parent.vertices.row(parent.faces(0, k)); };
  map.surface.vertices.row(n) = (corner(0) + corner(1) + corner(2)) / 3.0;
  map.surface.faces.resize(m + 2, 3);
  map.surface.faces.topRows(m) = parent.faces;
  const auto c = static_cast<Index>(n);
  const Index a = parent.faces(0, 0), b = parent.faces(0, 1), d = parent.faces(0, 2);
  map.surface.faces.row(0) << a, b, c;
  map.surface.faces.row(m) << b, d, c;
  map.surface.faces.row(m + 1) << d, a, c;
  map.uv = corners(map.surface, map.surface.vertices.leftCols<2>());
  map.uv32 = map.uv.cast<float>();
  set_identity_provenance(map);
  map.parent_face[static_cast<std::size_t>(m)] = 0;
  map.parent_face[static_cast<std::size_t>(m + 1)] = 0;
  map.vertex_parent[static_cast<std::size_t>(n)] = 0;
  map.vertex_barycentric.row(n).setConstant(1.0 / 3.0);
  return map;
}

// In which ways a refinement is wrong: provenance_test.cpp.
TEST(Certify, a_true_subdivision_passes_g7_and_a_moved_vertex_does_not) {
  const mesh::Surface parent = test::bumpy_grid(3, 3, 0.3, 2.0);
  Parametrization map = split_face(parent);
  certify_map(map, parent, {}, ExecutionContext());
  EXPECT_EQ(map.certificate.provenance_failures, 0);
  EXPECT_TRUE(map.certificate.ok);
  map.surface.vertices(2, 2) += 1e-12;
  certify_map(map, parent, {}, ExecutionContext());
  EXPECT_GT(map.certificate.provenance_failures, 0);
  EXPECT_THROW(require_certificate(map, "The test"), CertificateFailed);
}

TEST(Certify, failures_of_a_refined_map_name_faces_of_the_input_where_they_are_known) {
  const mesh::Surface parent = test::grid(3, 3);
  Parametrization map = split_face(parent);
  const Eigen::Index last = map.uv.rows() - 1;
  for (const Eigen::Index row : {last - 3, last})  // two thirds of face 0 are flipped
    map.uv.row(row).swap(map.uv.row(row - 1));
  certify_map(map, parent, {}, ExecutionContext());
  EXPECT_EQ(map.certificate.failed_faces.front(), map.surface.faces.rows() - 2);
  const Certificate named = in_input_faces(map);
  EXPECT_EQ(named.failed_faces, std::vector<FaceId>{0});
  EXPECT_EQ(named.failures.back(), "(Numbers are those of the refined mesh)");
  map.parent_face.clear();
  EXPECT_EQ(in_input_faces(map).failed_faces, map.certificate.failed_faces);
}

}  // namespace
}  // namespace flipfree::certify::certify_test
