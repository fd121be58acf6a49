// What is caught, what goes through, and under which numbers errors reach the caller.
#include "flipfree/base/failure.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace flipfree::failure_test {
namespace {

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

}  // namespace
}  // namespace flipfree::failure_test
