#include "flipfree/base/context.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>

#include "flipfree/base/error.h"

namespace flipfree::context_test {
namespace {

TEST(ExecutionContext, progress_of_nested_ranges_is_mapped_into_the_outer_one) {
  ExecutionContext context;
  const ProgressRange outer(context, 0.5, 1.0);
  {
    const ProgressRange inner(context, 0.5, 1.0);
    context.report("inner", 0.5);
    EXPECT_DOUBLE_EQ(context.fraction(), 0.875);
    EXPECT_STREQ(context.stage(), "inner");
  }
  context.report("outer", 1.0);
  EXPECT_DOUBLE_EQ(context.fraction(), 1.0);
}

TEST(ExecutionContext, fraction_never_falls) {
  ExecutionContext context;
  context.report("a", 0.7);
  context.report("b", 0.3);
  EXPECT_DOUBLE_EQ(context.fraction(), 0.7);
  EXPECT_STREQ(context.stage(), "b");
}

TEST(ExecutionContext, parts_are_cancelled_with_their_parent_but_not_the_other_way_round) {
  ExecutionContext parent;
  ExecutionContext part(&parent, 1);
  part.cancel();
  EXPECT_NO_THROW(parent.check());
  ExecutionContext sibling(&parent, 1);
  EXPECT_NO_THROW(sibling.check());
  parent.cancel();
  EXPECT_THROW(sibling.check(), Cancelled);
  EXPECT_THROW(sibling.report("late", 0.1), Cancelled);
}

// A clock that stands until it is moved.
struct Hand {
  double seconds = 100.0;
  void set(ExecutionContext& context) {
    context.clock = [this] { return seconds; };
  }
};

TEST(TimeLimit, checks_throw_from_its_end_on_and_not_before_or_after_it) {
  ExecutionContext context;
  Hand hand;
  hand.set(context);
  {
    const TimeLimit limit(context, 5.0);
    EXPECT_DOUBLE_EQ(context.seconds_left(), 5.0);
    hand.seconds = 104.9;
    EXPECT_NO_THROW(context.check());
    hand.seconds = 105.1;
    EXPECT_TRUE(context.time_is_over());
    EXPECT_THROW(context.check(), TimeIsOver);
    EXPECT_THROW(context.report("late", 0.5), TimeIsOver);
    EXPECT_DOUBLE_EQ(context.seconds_left(), 0.0);
  }
  EXPECT_NO_THROW(context.check());
}

TEST(TimeLimit, an_inner_one_ends_with_the_outer_one_at_the_latest) {
  ExecutionContext context;
  Hand hand;
  hand.set(context);
  const TimeLimit outer(context, 5.0);
  {
    const TimeLimit longer(context, 9.0);
    EXPECT_DOUBLE_EQ(context.seconds_left(), 5.0);
  }
  {
    const TimeLimit shorter(context, 2.0);
    hand.seconds = 103.0;
    EXPECT_THROW(context.check(), TimeIsOver);
    const Grace work(context);
    EXPECT_NO_THROW(context.check());
  }
  EXPECT_NO_THROW(context.check());
  hand.seconds = 106.0;
  EXPECT_THROW(context.check(), TimeIsOver);
}

TEST(TimeLimit, parts_have_their_parents_and_cancelling_goes_first) {
  ExecutionContext parent;
  Hand hand;
  hand.set(parent);
  const TimeLimit limit(parent, 5.0);
  ExecutionContext part(&parent, 1);
  hand.seconds = 106.0;
  EXPECT_THROW(part.check(), TimeIsOver);
  {
    const Grace work(part);
    EXPECT_NO_THROW(part.check());
  }
  parent.cancel();
  EXPECT_THROW(part.check(), Cancelled);
}

TEST(Grace, lasts_a_little_beyond_the_limit_and_cannot_be_accepted) {
  double seconds = 0;
  ExecutionContext context;
  context.clock = [&] { return seconds; };
  context.accept();
  const TimeLimit limit(context, 10.0);
  const MapInHand map(context);
  EXPECT_THROW(context.check(), TimeIsOver);
  {
    const Grace storing(context, Grace::kShort);
    seconds = 10.0 + 0.9 * Grace::kShort;
    EXPECT_NO_THROW(context.check());
    seconds = 10.0 + 1.1 * Grace::kShort;
    EXPECT_THROW(context.check(), TimeIsOver);
  }
  seconds = 0;
  EXPECT_EQ(context.seconds_left(), 0.0);
}

TEST(SecondsToSearch, leave_at_least_half_for_the_map_and_something_for_storing_it) {
  EXPECT_EQ(seconds_to_search(1.0, 1000000000), 0.5);
  EXPECT_GT(seconds_to_search(1.0, 1000), 0.99);
  EXPECT_LT(seconds_to_search(1.0, 1000), 1.0);
  const double forever = std::numeric_limits<double>::infinity();
  EXPECT_EQ(seconds_to_search(forever, 1000), forever);
}

TEST(MapInHand, parts_are_accepted_with_their_parent_and_have_its_map) {
  ExecutionContext parent;
  ExecutionContext before(&parent, 1);
  const MapInHand map(parent);
  ExecutionContext part(&parent, 1);
  EXPECT_NO_THROW(part.check());
  parent.accept();
  EXPECT_THROW(part.check(), TimeIsOver);
  EXPECT_NO_THROW(before.check());
  const MapInHand own(before);
  EXPECT_THROW(before.check(), TimeIsOver);
  parent.cancel();
  EXPECT_THROW(part.check(), Cancelled);
}

TEST(SharedProgress, adds_up_what_parts_have_done_in_the_range_of_the_whole) {
  ExecutionContext whole;
  const ProgressRange range(whole, 0.0, 0.5);
  SharedProgress progress(whole, 0.2);
  ExecutionContext first(&whole, 1, &progress, 0.5);
  ExecutionContext second(&whole, 1, &progress, 0.3);
  first.report("first", 0.5);
  EXPECT_DOUBLE_EQ(whole.fraction(), 0.5 * 0.45);
  second.report("second", 1.0);
  EXPECT_DOUBLE_EQ(whole.fraction(), 0.5 * 0.75);
  first.report("first", 0.25);  // falling back changes nothing
  EXPECT_DOUBLE_EQ(whole.fraction(), 0.5 * 0.75);
  first.report("first", 1.0);
  EXPECT_DOUBLE_EQ(whole.fraction(), 0.5);
}

}  // namespace
}  // namespace flipfree::context_test
