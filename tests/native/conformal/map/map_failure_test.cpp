#include "flipfree/conformal/map/map_failure.h"
#include "flipfree/base/failure/elements.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace flipfree::conformal::map_failure_test {
namespace {

ConformalMetric some_metric() {
  ConformalMetric metric;
  metric.angle_error = 1.234567e-11;
  metric.scale_range = 42.0;
  return metric;
}

std::vector<FaceId> many_faces() {
  std::vector<FaceId> faces;
  for (FaceId f = 7; f < 5000; ++f) faces.push_back(f);
  return faces;
}

TEST(MapFailure, NumbersHaveThreeDigits) {
  EXPECT_EQ(scientific(1.234567e-11), "1.23e-11");
  EXPECT_EQ(scientific(0.0), "0");
}

TEST(MapFailure, NamesTheFacesAndWhatToDo) {
  const std::vector<FaceId> faces = many_faces();
  for (const Error& error : {not_storable(some_metric(), faces), needs_refinement(faces)}) {
    EXPECT_EQ(error.kind, ElementKind::kFace);
    ASSERT_EQ(error.elements.size(), kMostElements);
    EXPECT_EQ(error.elements.front(), 7);
    EXPECT_NE(error.message.find(std::to_string(faces.size())), std::string::npos)
        << "all are counted: " << error.message;
    EXPECT_NE(error.message.find("first face 7"), std::string::npos);
  }
  EXPECT_EQ(not_storable(some_metric(), {3}).code, ErrorCode::kRoundingFlips);
  EXPECT_NE(needs_refinement({3}).message.find("original_triangles"), std::string::npos);
}

TEST(MapFailure, OfACertificateIsItsFirstSentence) {
  certify::Certificate certificate;
  certificate.failures = {"G1: one.", "G2: two."};
  certificate.failed_faces = {4, 9};
  const Error error = not_certified(some_metric(), certificate);
  EXPECT_EQ(error.code, ErrorCode::kCertificateFailed);
  EXPECT_NE(error.message.find("G1: one."), std::string::npos);
  EXPECT_EQ(error.message.find("G2"), std::string::npos);
  EXPECT_EQ(error.elements, certificate.failed_faces);
}

TEST(MapFailure, OutOfTimeTheMetricIsStillOffered) {
  const Error error = out_of_time(some_metric());
  EXPECT_EQ(error.code, ErrorCode::kTimeLimit);
  EXPECT_NE(error.message.find("1.23e-11"), std::string::npos);
  EXPECT_NE(error.message.find("max_seconds"), std::string::npos);
  EXPECT_TRUE(error.elements.empty());
}

}  // namespace
}  // namespace flipfree::conformal::map_failure_test
