#include "flipfree/certify/certified_map.h"

#include <gtest/gtest.h>

#include <string>

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

}  // namespace
}  // namespace flipfree::certify::certified_map_test
