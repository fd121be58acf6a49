#include "flipfree/certify/measures.h"

#include <gtest/gtest.h>

#include <limits>

#include "flipfree/base/error.h"

namespace flipfree::certify::pins_test {
namespace {

// What is said of pins of a mesh of two triangles; no words: nothing.
template <typename Require>
Error refusal(Require require, const std::vector<CornerPin>& pins) {
  try {
    require(pins, Index{6});
  } catch (const InvalidInput& e) {
    return e.error();
  }
  return {};
}

TEST(Pins, of_corners_that_exist_may_lie_anywhere) {
  const double beyond = 2.0 * std::numeric_limits<float>::max();
  EXPECT_NO_THROW(require_corners({{0, {0, 0}}, {5, {beyond, 0}}}, 6));
  EXPECT_NO_THROW(require_corners({}, 0));
}

TEST(Pins, of_corners_that_do_not_exist_are_refused_by_name) {
  for (const CornerId corner : {-1, 6}) {
    for (const Error& error : {refusal(require_corners, {{2, {0, 0}}, {corner, {0, 0}}}),
                               refusal(require_storable_pins, {{2, {0, 0}}, {corner, {0, 0}}})}) {
      EXPECT_EQ(error.code, ErrorCode::kBadPins);
      EXPECT_NE(rendered(error.message).find("corner " + std::to_string(corner) + ","),
                std::string::npos);
      EXPECT_TRUE(error.elements.empty());
    }
  }
}

TEST(Pins, must_be_where_32_bits_reach) {
  const double most = std::numeric_limits<float>::max();
  EXPECT_NO_THROW(require_storable_pins({{0, {most, -most}}, {1, {1e-300, 0}}}, 6));
  for (const double bad : {2 * most, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    for (const Vector2& uv : {Vector2(bad, 0), Vector2(0, -bad)}) {
      const Error error = refusal(require_storable_pins, {{3, {0, 0}}, {4, uv}});
      EXPECT_EQ(error.code, ErrorCode::kBadPins);
      EXPECT_EQ(error.kind, ElementKind::kCorner);
      EXPECT_EQ(error.elements, std::vector<Index>{4});
    }
  }
}

}  // namespace
}  // namespace flipfree::certify::pins_test
