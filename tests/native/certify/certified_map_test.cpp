#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/separated_map.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify::certified_map_test {
namespace {

using test::flat;

Parametrization flat_map() {
  Parametrization map;
  map.surface = test::grid(2, 2);
  map.uv = flat(map.surface);
  map.uv32 = map.uv.cast<float>();
  set_identity_provenance(map);
  return map;
}

TEST(CertifyMap, judges_the_arrays_of_the_map_whatever_else_is_asked) {
  const Parametrization other = flat_map();
  CertifyRequest extra;  // what it names of another map is not looked at
  const Points2 flipped = -other.uv.rowwise().reverse();
  extra.uv = &flipped;
  extra.pins = {{4, other.uv.row(4).transpose()}};
  Parametrization map = flat_map();
  certify_map(map, other.surface, extra, ExecutionContext());
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(map.certificate.pin_failures, 0);
  EXPECT_EQ(map.certificate.provenance_failures, 0);
  map.uv32(4, 0) += 1e-4F;
  certify_map(map, other.surface, extra, ExecutionContext());
  EXPECT_EQ(map.certificate.pin_failures, 1);
}

TEST(RequireCertificate, names_faces_of_the_input_each_once_and_says_so) {
  Parametrization map = flat_map();
  map.certificate.failed_faces = {1, 3, 5};
  map.certificate.failures = {"G1: three triangles"};
  EXPECT_EQ(in_input_faces(map).failures.size(), 1U) << "not refined";
  map.parent_face = {4, 4, 0, 2, 1, 4, 0, 0};
  const Certificate named = in_input_faces(map);
  EXPECT_EQ(named.failed_faces, (std::vector<FaceId>{2, 4}));
  ASSERT_EQ(named.failures.size(), 2U);
  EXPECT_NE(named.failures[1].find("refined"), std::string::npos);
  try {
    require_certificate(map, "The test");
    FAIL();
  } catch (const CertificateFailed& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kCertificateFailed);
    EXPECT_EQ(e.error().kind, ElementKind::kFace);
    EXPECT_EQ(e.error().elements, (std::vector<Index>{2, 4}));
    EXPECT_EQ(e.error().message.find("The test did not pass"), 0U);
    EXPECT_NE(e.error().message.find("G1: three triangles."), std::string::npos);
  }
}

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

// Two squares of a plane, a third one upright on the edge that they share; faces 4 and 5 are the
// upright one's, face 6 uses a vertex twice.
mesh::Surface t_wall() {
  mesh::Surface s;
  s.vertices.resize(8, 3);
  s.vertices << 0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, -1, 0, 0, -1, 1, 0, 0, 0, 1, 0, 1, 1;
  s.faces = Triangles{{0, 2, 3}, {0, 3, 1}, {4, 0, 1}, {4, 1, 5}, {0, 6, 7}, {0, 7, 1}, {6, 6, 7}};
  return s;
}

// Each face at its own place but for those of the plane, which are where they are.
Points2 plane_map(const mesh::Surface& s) {
  Points2 uv(s.faces.size(), 2);
  for (CornerId c = 0; c < static_cast<CornerId>(uv.rows()); ++c) {
    const VertexId v = s.faces(c / 3, c % 3);
    const bool upright = c >= 12;
    if (upright) {
      uv.row(c) << 5.0 + s.vertices(v, 2), 5.0 + s.vertices(v, 1);
    } else {
      uv.row(c) << s.vertices(v, 0), s.vertices(v, 1);
    }
  }
  return uv;
}

// Face 6, which uses vertex 6 twice, has corners 18 to 20.
TEST(SeparatedMap, MeetsPinsOfFacesWithoutATriangleBitForBit) {
  const mesh::Surface s = t_wall();
  const Points2 uv = plane_map(s);
  mesh::SeparateOptions options;
  options.corner_uv = &uv;
  const SeparatedMap separated(s, options, ExecutionContext());
  Parametrization solved;
  solved.surface = separated.surface();
  solved.uv = separated.corners(uv);
  solved.uv32 = solved.uv.cast<float>();
  CertifyRequest request;
  request.pins = {{0, uv.row(0)}, {19, {0.375, -2.0}}};
  Parametrization back = separated.on_input(solved, request, ExecutionContext());
  EXPECT_TRUE(back.certificate.ok);
  EXPECT_EQ(back.certificate.pin_failures, 0);
  EXPECT_EQ(back.uv.row(19), Eigen::RowVector2d(0.375, -2.0));
  EXPECT_EQ(back.uv32.row(19), Eigen::RowVector2f(0.375F, -2.0F));

  // The judge looks at them by itself: in either precision, the last bit counts.
  request.surface = &s;
  request.uv = &back.uv;
  request.uv32 = &back.uv32;
  EXPECT_TRUE(certify_any(request, ExecutionContext()).ok);
  const Points2f stored = back.uv32;
  back.uv32(19, 0) = std::nextafter(0.375F, 1.0F);
  const Certificate missed = certify_any(request, ExecutionContext());
  EXPECT_FALSE(missed.ok);
  EXPECT_EQ(missed.pin_failures, 1);
  EXPECT_EQ(missed.failed_faces, std::vector<Index>{6});
  back.uv32 = stored;
  back.uv(19, 1) = std::nextafter(-2.0, 0.0);
  EXPECT_EQ(certify_any(request, ExecutionContext()).pin_failures, 1);
}

TEST(SeparatedMap, RefusesTwoPlacesForOneCornerWithoutATriangle) {
  const mesh::Surface s = t_wall();
  const SeparatedMap separated(s, {}, ExecutionContext());
  EXPECT_TRUE(separated.pins({{19, {0.5, 0.5}}, {19, {0.5, 0.5}}}).empty());
  EXPECT_THROW(separated.pins({{19, {0.5, 0.5}}, {19, {0.5, 0.25}}}), InvalidInput);
  EXPECT_THROW(separated.pins({{19, {1e39, 0.5}}}), InvalidInput);
}

TEST(SeparatedMap, ErrorsNameTheInputsElementsInWordsToo) {
  mesh::Surface s = t_wall();
  Triangles faces = s.faces;
  faces.row(6).swap(faces.row(0));  // faces are numbered otherwise once it is gone
  s.faces = std::move(faces);
  const SeparatedMap separated(s, {}, ExecutionContext());
  try {
    separated.solve([]() -> int {
      throw_not_converged(ErrorCode::kRoundingFlips, "Triangle at face " + face_id(0) + " folds.",
                          ElementKind::kFace, {0});
    });
    FAIL();
  } catch (const NotConverged& e) {
    EXPECT_STREQ(e.what(), "Triangle at face 1 folds.");
    EXPECT_EQ(e.error().elements, std::vector<Index>{1});
  }
  Certificate bad;
  bad.failures = {"G1: 1 triangle is flipped, first face " + face_id(5)};
  bad.failed_faces = {5};
  try {
    separated.solve([&]() -> int { throw CertificateFailed("The map", bad); });
    FAIL();
  } catch (const CertificateFailed& e) {
    EXPECT_EQ(e.certificate().failed_faces, std::vector<Index>{6});
    EXPECT_NE(std::string(e.what()).find("first face 6"), std::string::npos);
  }
}

// A flat fan around vertex 0 behind a face that uses a vertex twice, so that ids are shifted; face
// `turned`, if any, is wound the other way.
mesh::Surface fan_behind_a_collapsed_face(FaceId turned) {
  mesh::Surface s;
  s.vertices.resize(7, 3);
  s.vertices.row(0).setZero();
  Triangles faces(7, 3);
  faces.row(0) << 0, 1, 0;
  for (Index i = 0; i < 6; ++i) {
    const double angle = i * std::numbers::pi / 3.0;
    s.vertices.row(i + 1) << std::cos(angle), std::sin(angle), 0.0;
    faces.row(i + 1) << 0, i + 1, (i + 1) % 6 + 1;
  }
  if (turned != kInvalid) std::swap(faces(turned, 1), faces(turned, 2));
  s.faces = std::move(faces);
  return s;
}

// Across the spokes, around vertex 0, against the clock; per face of the fan the half-edge that
// ends or, where it is turned over, begins at the centre.
std::vector<HalfedgeId> around(FaceId turned) {
  std::vector<HalfedgeId> strip;
  for (FaceId f = 1; f < 7; ++f) strip.push_back(3 * f + (f == turned ? 0 : 2));
  return strip;
}

Certificate judged_along(const mesh::Surface& s, const std::vector<HalfedgeId>& strip,
                         Index turns) {
  Points2 uv(s.faces.size(), 2);
  for (CornerId c = 0; c < static_cast<CornerId>(uv.rows()); ++c)
    uv.row(c) = s.vertices.row(s.faces(c / 3, c % 3)).head<2>();
  CertifyRequest request;
  request.surface = &s;
  request.uv = &uv;
  request.require_seamless = true;
  request.loops = {{strip, turns}};
  return certify_any(request, ExecutionContext());
}

TEST(SeparatedMap, JudgesLoopsOfTheInputWhereTheirFacesHaveGone) {
  for (const FaceId turned : {kInvalid, FaceId{3}, FaceId{1}}) {
    const mesh::Surface s = fan_behind_a_collapsed_face(turned);
    // Which way is left is said by the first face of a strip.
    const Index turns = turned == 1 ? -4 : 4;
    const Certificate good = judged_along(s, around(turned), turns);
    EXPECT_TRUE(good.ok) << (good.ok ? "" : good.failures.front());
    EXPECT_EQ(good.holonomy_failures, 0);
    const Certificate bad = judged_along(s, around(turned), turns - 1);
    EXPECT_FALSE(bad.ok);
    EXPECT_EQ(bad.holonomy_failures, 1);
    EXPECT_EQ(bad.failed_faces, std::vector<FaceId>{1});
    EXPECT_NE(rendered(bad.failures.front()).find("through face 1"), std::string::npos);
  }
}

TEST(SeparatedMap, LoopsThroughFacesThatUseAVertexTwiceAreNoStrips) {
  const mesh::Surface s = fan_behind_a_collapsed_face(kInvalid);
  for (const std::vector<HalfedgeId>& strip :
       {std::vector<HalfedgeId>{0, 0}, {}, {3 * 7}, {-1}, {3, 0, 5}}) {
    const Certificate found = judged_along(s, strip, 0);
    EXPECT_FALSE(found.ok);
    EXPECT_EQ(found.holonomy_failures, 1);
  }
  mesh::Surface nothing = s;
  nothing.faces = Triangles(s.faces.triangles().topRows(1));
  EXPECT_FALSE(judged_along(nothing, {0, 0, 0}, -1).ok);
}

}  // namespace
}  // namespace flipfree::certify::certified_map_test
