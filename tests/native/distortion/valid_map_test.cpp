#include "flipfree/distortion/valid_map.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "flipfree/base/error.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::distortion::valid_map_test {
namespace {

Error refusal(const mesh::Surface& surface, const Points2& uv) {
  try {
    require_valid_map(surface, uv, ExecutionContext());
  } catch (const InvalidInput& e) {
    return e.error();
  }
  return {};
}

TEST(ValidMap, flipped_collapsed_and_infinite_triangles_are_named) {
  const mesh::Surface surface = test::grid(3, 3);
  const Points2 good = test::flat(surface);
  EXPECT_EQ(refusal(surface, good).code, ErrorCode::kInternal) << "nothing thrown";
  Points2 uv = good;
  uv.row(3 * 4).swap(uv.row(3 * 4 + 1));
  EXPECT_EQ(refusal(surface, uv).elements, std::vector<Index>{4});
  EXPECT_NE(refusal(surface, uv).message.find("1 triangle of the map is"), std::string::npos);
  uv.row(3 * 7) = uv.row(3 * 7 + 1);
  uv(3 * 9, 0) = std::numeric_limits<double>::quiet_NaN();
  const Error error = refusal(surface, uv);
  EXPECT_EQ(error.code, ErrorCode::kFlippedMap);
  EXPECT_EQ(error.kind, ElementKind::kFace);
  EXPECT_EQ(error.elements, (std::vector<Index>{4, 7, 9}));
  EXPECT_NE(error.message.find("3 triangles"), std::string::npos);
}

TEST(ValidMap, at_most_a_thousand_faces_are_named) {
  const mesh::Surface surface = test::grid(30, 30);
  const Points2 mirrored = -test::flat(surface).rowwise().reverse().eval();
  const Points2 turned = mirrored.rowwise().reverse();
  EXPECT_EQ(refusal(surface, turned).code, ErrorCode::kInternal) << "half a turn is no flip";
  const Points2 flipped = test::flat(surface).rowwise().reverse();
  EXPECT_EQ(refusal(surface, flipped).elements.size(), 1000U);
  EXPECT_NE(refusal(surface, flipped).message.find("1800 triangles"), std::string::npos);
}

TEST(ValidMap, defects_of_the_surface_and_of_the_shape_come_first) {
  mesh::Surface surface = test::grid(2, 2);
  const Points2 uv = test::flat(surface);
  EXPECT_EQ(refusal(surface, uv.topRows(12)).code, ErrorCode::kBadShape);
  surface.faces(0, 0) = surface.faces(0, 1);
  EXPECT_EQ(refusal(surface, uv).code, ErrorCode::kRepeatedCorner);
}

}  // namespace
}  // namespace flipfree::distortion::valid_map_test
