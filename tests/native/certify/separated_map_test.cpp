#include "flipfree/certify/separated_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::certify::separated_map_test {
namespace {

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
}  // namespace flipfree::certify::separated_map_test
