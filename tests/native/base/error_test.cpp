#include "flipfree/base/error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace flipfree::error_test {
namespace {

// What `call` throws, which must be exactly an E.
template <typename E, typename Call>
Error thrown(const Call& call) {
  try {
    call();
  } catch (const E& e) {
    EXPECT_EQ(e.error().message, e.what());
    return e.error();
  } catch (const Exception&) {
    ADD_FAILURE() << "another type";
    return {};
  }
  ADD_FAILURE() << "nothing thrown";
  return {};
}

TEST(ErrorCode, every_code_has_a_text_of_its_own) {
  std::vector<std::string> texts;
  for (int code = 0; code <= static_cast<int>(ErrorCode::kInternal); ++code) {
    texts.emplace_back(describe(static_cast<ErrorCode>(code)));
    EXPECT_NE(texts.back(), "unknown error");
  }
  std::sort(texts.begin(), texts.end());
  EXPECT_EQ(std::adjacent_find(texts.begin(), texts.end()), texts.end());
}

TEST(Error, reaches_the_catcher_with_all_its_parts) {
  const Error invalid = thrown<InvalidInput>([] {
    throw_invalid(ErrorCode::kBadPins, "Pins.", ElementKind::kVertex, {3, 1});
  });
  EXPECT_EQ(invalid.code, ErrorCode::kBadPins);
  EXPECT_EQ(invalid.message, "Pins.");
  EXPECT_EQ(invalid.kind, ElementKind::kVertex);
  EXPECT_EQ(invalid.elements, (std::vector<Index>{3, 1}));
  EXPECT_TRUE(invalid.witness.rule.empty());

  const Error infeasible = thrown<Infeasible>([] {
    throw_infeasible(ErrorCode::kNoRoomInPolygon, "Room.", {"area", {{"given", {1.0, 2.0}}}},
                     ElementKind::kFace, {7});
  });
  EXPECT_EQ(infeasible.code, ErrorCode::kNoRoomInPolygon);
  EXPECT_EQ(infeasible.kind, ElementKind::kFace);
  EXPECT_EQ(infeasible.elements, (std::vector<Index>{7}));
  EXPECT_EQ(infeasible.witness.rule, "area");
  EXPECT_EQ(infeasible.witness.numbers.at(0).second, (std::vector<double>{1.0, 2.0}));
}

TEST(Error, those_without_an_argument_know_their_code) {
  EXPECT_EQ(thrown<Cancelled>([] { throw Cancelled(); }).code, ErrorCode::kCancelled);
  EXPECT_EQ(thrown<TimeIsOver>([] { throw TimeIsOver(); }).code, ErrorCode::kTimeLimit);
  const Error internal = thrown<InternalError>([] { throw InternalError("Bug."); });
  EXPECT_EQ(internal.code, ErrorCode::kInternal);
  EXPECT_EQ(internal.message, "Bug.");
}

// Those who give a way up on NotConverged and take another must not swallow these.
TEST(Error, neither_the_end_of_time_nor_a_cancel_is_a_failure_to_converge) {
  EXPECT_FALSE((std::is_base_of_v<NotConverged, TimeIsOver>));
  EXPECT_FALSE((std::is_base_of_v<NotConverged, Cancelled>));
  EXPECT_FALSE((std::is_base_of_v<NotConverged, InternalError>));
}

}  // namespace
}  // namespace flipfree::error_test
