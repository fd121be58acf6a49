#include "flipfree/seamless/request.h"

#include <gtest/gtest.h>

#include "flipfree/certify/certified_map.h"

namespace flipfree::seamless::error_places_test {
namespace {

const std::vector<FaceId> kFaces{10, 11, 11, 12};
const std::vector<VertexId> kVertices{7, 5, 3};

Error error_at(ElementKind kind, std::vector<Index> elements) {
  return {ErrorCode::kRoundingFlips, "text", kind, std::move(elements)};
}

TEST(ErrorPlaces, areThoseOfTheCallersMesh) {
  EXPECT_EQ(placed_in(error_at(ElementKind::kFace, {3, 1, 2}), kFaces, kVertices).elements,
            (std::vector<Index>{12, 11}));
  EXPECT_EQ(placed_in(error_at(ElementKind::kVertex, {2, 0, 9}), kFaces, kVertices).elements,
            (std::vector<Index>{3, 7}));
  EXPECT_EQ(placed_in(error_at(ElementKind::kEdge, {0, 1, 1, 2}), kFaces, kVertices).elements,
            (std::vector<Index>{7, 5, 5, 3}));
  const Error corner = placed_in(error_at(ElementKind::kCorner, {4}), kFaces, kVertices);
  EXPECT_EQ(corner.kind, ElementKind::kFace);
  EXPECT_EQ(corner.elements, (std::vector<Index>{11}));
}

TEST(ErrorPlaces, whatTheCallerDoesNotHaveIsLeftOut) {
  const Error error = placed_in(error_at(ElementKind::kEdge, {0, 9}), kFaces, kVertices);
  EXPECT_EQ(error.kind, ElementKind::kNone);
  EXPECT_TRUE(error.elements.empty());
}

TEST(ErrorPlaces, anExceptionIsThrownAgainWithThem) {
  try {
    try {
      throw NotConverged(error_at(ElementKind::kFace, {0}));
    } catch (...) {
      rethrow_placed(kFaces, kVertices);
    }
  } catch (const NotConverged& error) {
    EXPECT_EQ(error.error().elements, (std::vector<Index>{10}));
  }
  certify::Certificate certificate;
  certificate.failures = {"A triangle is flipped."};
  certificate.failed_faces = {3};
  try {
    try {
      throw certify::CertificateFailed("The map", certificate);
    } catch (...) {
      rethrow_placed(kFaces, kVertices);
    }
  } catch (const certify::CertificateFailed& error) {
    EXPECT_EQ(error.certificate().failed_faces, (std::vector<FaceId>{12}));
  }
  EXPECT_THROW(
      {
        try {
          throw Cancelled();
        } catch (...) {
          rethrow_placed(kFaces, kVertices);
        }
      },
      Cancelled);
}

}  // namespace
}  // namespace flipfree::seamless::error_places_test
