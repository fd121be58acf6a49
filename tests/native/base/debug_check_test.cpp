#include "flipfree/base/failure.h"

#include <gtest/gtest.h>

#include <string>

#include "flipfree/base/error.h"

namespace flipfree::debug_check_test {
namespace {

TEST(DebugCheck, BrokenInvariantIsAnInternalErrorThatNamesThePlace) {
  EXPECT_NO_THROW(require_invariant("cut", ""));
  try {
    require_invariant("cut", "edge 3 has one flag");
    FAIL() << "nothing was thrown";
  } catch (const InternalError& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kInternal);
    EXPECT_EQ(e.error().message, "cut: edge 3 has one flag");
  }
}

TEST(DebugCheck, IsAskedInBuildsWithChecksOnly) {
  int asked = 0;
  const auto broken = [&] {
    ++asked;
    return std::string("broken");
  };
  const auto fails = [&] {
    ++asked;
    return false;
  };
  if constexpr (kDebugChecks) {
    EXPECT_THROW(debug_check("here", broken), InternalError);
    EXPECT_THROW(debug_require("here", "holds", fails), InternalError);
    EXPECT_EQ(asked, 2);
  } else {
    EXPECT_NO_THROW(debug_check("here", broken));
    EXPECT_NO_THROW(debug_require("here", "holds", fails));
    EXPECT_EQ(asked, 0);
  }
}

}  // namespace
}  // namespace flipfree::debug_check_test
