#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"

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

// What is caught, what goes through, and under which numbers errors reach the caller.
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

// A clock that goes on by one second at every look at it.
void tick(ExecutionContext& context) {
  context.clock = [now = 0.0]() mutable { return now += 1.0; };
}

TEST(GiveUp, AWayThatRunsOutOfItsShareIsGivenUp) {
  ExecutionContext context;
  tick(context);
  const TimeLimit all(context, 1000);
  EXPECT_TRUE(ended_in_time(context, [&] { context.check(); }));
  EXPECT_FALSE(ended_in_time(context, [&] {
    const TimeLimit share(context, 3);
    while (true) context.check();
  }));
}

TEST(GiveUp, WhenAllTimeIsOverTheCallEnds) {
  ExecutionContext context;
  tick(context);
  const TimeLimit all(context, 5);
  const auto endless = [&] {
    while (true) context.check();
  };
  EXPECT_THROW(ended_in_time(context, endless), TimeIsOver);
  EXPECT_FALSE(ended_in_time(endless));
}

TEST(GiveUp, OfAPartAnInfeasibleIsNoProofForTheWhole) {
  const auto infeasible = []() -> int {
    throw_infeasible(ErrorCode::kNoRoomInPolygon, "Room.", {"area", {}});
  };
  EXPECT_THROW(attempt(infeasible), Infeasible);
  const Outcome<int> part = attempt_part(infeasible);
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().code, ErrorCode::kNoRoomInPolygon);
  EXPECT_EQ(*attempt_part([] { return 3; }), 3);
  EXPECT_THROW(attempt_part([]() -> int { throw TimeIsOver(); }), TimeIsOver);
}

TEST(InTime, ALimitOfItsOwnIsNamedAndOneAroundItGoesOn) {
  ExecutionContext context;
  tick(context);
  const auto endless = [&]() -> int {
    while (true) context.check();
  };
  EXPECT_EQ(in_time(context, 3, "It", "or less", [] { return 5; }), 5);
  try {
    in_time(context, 3, "It was not found", "or ask for less", endless);
    FAIL() << "went on";
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kTimeLimit);
    EXPECT_NE(e.error().message.find("It was not found"), std::string::npos);
    EXPECT_NE(e.error().message.find("max_seconds = 3"), std::string::npos);
  }
  const TimeLimit all(context, 5);
  EXPECT_THROW(in_time(context, 0, "It", "or less", endless), TimeIsOver);
}

TEST(Elements, FacesOfAnErrorAreThoseThatItNamesOrThoseAtItsVertices) {
  Triangles faces(3, 3);
  faces << 0, 1, 2, 2, 1, 3, 3, 4, 5;
  Error error;
  error.elements = {2, 5};
  error.kind = ElementKind::kFace;
  EXPECT_EQ(faces_at(error, faces), (std::vector<FaceId>{2, 5}));
  error.kind = ElementKind::kVertex;
  EXPECT_EQ(faces_at(error, faces), (std::vector<FaceId>{0, 1, 2}));
  error.elements = {0};
  EXPECT_EQ(faces_at(error, faces), std::vector<FaceId>{0});
  error.kind = ElementKind::kEdge;
  EXPECT_TRUE(faces_at(error, faces).empty());
}

TEST(Renumber, ReplacesMarkedIdsAndNothingElse) {
  const Renumbering shifted{[](Index v) { return v > 90 ? kInvalid : v + 100; },
                            [](Index f) { return f + 1000; }, [](Index c) { return 2 * c; }};
  const struct {
    std::string said;
    const char* wanted;
  } cases[] = {
      {"Chart of face " + face_id(0) + " (12 triangles, first at vertex " + vertex_id(7) + ")",
       "Chart of face 1000 (12 triangles, first at vertex 107)"},
      {"Corner " + corner_id(21) + " is pinned to 0.5, corner 4 is not.",
       "Corner 42 is pinned to 0.5, corner 4 is not."},
      {"edge " + vertex_id(3) + "-" + vertex_id(5) + "; vertex 3 of " + vertex_id(1),
       "edge 103-105; vertex 3 of 101"},
      {"vertex " + vertex_id(99) + ", " + vertex_id(-1), "vertex 99, -1"},
      {"vertex " + vertex_id(std::int64_t{99999999999}), "vertex 99999999999"},
      {"", ""},
  };
  for (const auto& c : cases) EXPECT_EQ(rendered(renumbered(c.said, shifted)), c.wanted);
}

TEST(Renumber, AnErrorNamesNoElementThatTheOtherMeshDoesNotHave) {
  const Error error{ErrorCode::kBadPins, "At " + vertex_id(3), ElementKind::kVertex, {3, 5}};
  EXPECT_EQ(renumbered(error, known_in(6, 1)).elements, error.elements);
  const Error fewer = renumbered(error, known_in(5, 1));
  EXPECT_EQ(fewer.kind, ElementKind::kNone);
  EXPECT_TRUE(fewer.elements.empty());
  EXPECT_STREQ(InvalidInput(fewer).what(), "At 3");
}

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
}  // namespace flipfree::error_test
