#include "flipfree/base/failure.h"

#include <gtest/gtest.h>

#include <memory>

namespace flipfree::outcome_test {
namespace {

TEST(Outcome, HoldsTheValueOfAStepThatSucceeds) {
  Outcome<std::unique_ptr<int>> outcome = attempt([] { return std::make_unique<int>(7); });
  ASSERT_TRUE(outcome);
  EXPECT_EQ(**outcome, 7);
}

TEST(Outcome, HoldsTheErrorOfAStepThatDoesNotConverge) {
  const Outcome<int> outcome = attempt([]() -> int {
    throw_not_converged(ErrorCode::kLineSearchStalled, "Stuck.", ElementKind::kVertex, {3});
  });
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, ErrorCode::kLineSearchStalled);
  EXPECT_EQ(outcome.error().elements, std::vector<Index>{3});
}

// Neither a bug nor the end of the time may be taken for a way that is blocked.
TEST(Outcome, LetsEverythingElseThrough) {
  EXPECT_THROW(attempt([]() -> int { throw InternalError("a bug"); }), InternalError);
  EXPECT_THROW(attempt([]() -> int { throw TimeIsOver(); }), TimeIsOver);
  EXPECT_THROW(attempt([]() -> int { throw Cancelled(); }), Cancelled);
  EXPECT_THROW(attempt([]() -> int { throw_invalid(ErrorCode::kBadPins, "Bad."); }), InvalidInput);
}

class Richer : public NotConverged {
  using NotConverged::NotConverged;
};

TEST(TranslateErrors, ChangesTheErrorAndKeepsItsKind) {
  const auto nameless = [](Error error) {
    error.elements.clear();
    return error;
  };
  try {
    with_errors(nameless, []() -> int {
      throw_invalid(ErrorCode::kBadPins, "Bad.", ElementKind::kVertex, {9});
    });
    FAIL() << "went on";
  } catch (const InvalidInput& failure) {
    EXPECT_TRUE(failure.error().elements.empty());
    EXPECT_EQ(failure.error().message, "Bad.");
  }
  EXPECT_THROW(with_errors(nameless, []() -> int { throw InternalError("a bug"); }), InternalError);
  EXPECT_THROW(with_errors(nameless, []() -> int { throw TimeIsOver(); }), TimeIsOver);
  EXPECT_EQ(with_errors(nameless, [] { return 4; }), 4);
}

TEST(TranslateErrors, LeavesErrorsThatCarryMoreAsTheyAre) {
  const Error error{ErrorCode::kCertificateFailed, "No.", ElementKind::kVertex, {9}};
  try {
    with_errors(
        [](Error e) {
          e.message = "changed";
          return e;
        },
        [&]() -> int { throw Richer(error); });
    FAIL() << "went on";
  } catch (const Richer& failure) {
    EXPECT_EQ(failure.error().message, "No.");
  }
}

}  // namespace
}  // namespace flipfree::outcome_test
