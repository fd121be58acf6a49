#include "flipfree/field/smoothest.h"

#include <gtest/gtest.h>

#include "field/fields.h"
#include "flipfree/base/error.h"
#include "flipfree/field/guidance.h"
#include "flipfree/field/turning.h"

namespace flipfree::field::smoothest_test {
namespace {

Crosses solve(const Place& p, const Wishes& wishes, ExecutionContext& context) {
  return smoothest(face_graphs(p.surface, p.adjacency, p.frames), wishes, context);
}

Index count_cones(const Place& p, const Crosses& u) {
  std::vector<double> angle(p.faces());
  for (std::size_t f = 0; f < angle.size(); ++f)
    angle[f] = 0.25 * std::arg(u[static_cast<Eigen::Index>(f)]);
  const CrossField field = match_nearest(p.adjacency, p.frames, std::move(angle));
  Index count = 0;
  for (const Index k : cone_turns(p.surface.faces, p.adjacency, p.frames, field)) count += k != 4;
  return count;
}

TEST(SmoothestTest, ABoxHasItsConesAtTheEightCorners) {
  const Place p(test::perforated_plate(0, 4));
  ExecutionContext context;
  EXPECT_EQ(count_cones(p, solve(p, no_wishes(static_cast<Index>(p.faces())), context)), 8);
}

TEST(SmoothestTest, ATorusOfRevolutionNeedsNone) {
  const Place p(test::torus(40, 16, 0.2));
  ExecutionContext context;
  EXPECT_EQ(count_cones(p, solve(p, no_wishes(static_cast<Index>(p.faces())), context)), 0);
}

TEST(SmoothestTest, OneHeldFaceDecidesForAWholePlane) {
  const Place p(test::grid(20, 20));
  Wishes wishes = no_wishes(static_cast<Index>(p.faces()));
  wishes.held[0] = 1;
  wishes.cross[0] = std::polar(1.0, 4.0 * 0.3);
  ExecutionContext context;
  const Crosses u = solve(p, wishes, context);
  std::vector<double> angle(p.faces());
  for (std::size_t f = 0; f < angle.size(); ++f)
    angle[f] = 0.25 * std::arg(u[static_cast<Eigen::Index>(f)]);
  const Points3 d = directions_of(p.surface, angle);
  for (Eigen::Index f = 0; f < d.rows(); ++f) {
    EXPECT_NEAR(
        std::remainder(std::atan2(d(f, 1), d(f, 0)) - std::atan2(d(0, 1), d(0, 0)), kTestQuarter),
        0.0, 1e-6);
  }
}

TEST(SmoothestTest, CanBeCancelled) {
  const Place p(test::sphere(24, 16));
  ExecutionContext context;
  context.cancel();
  EXPECT_THROW(solve(p, no_wishes(static_cast<Index>(p.faces())), context), Cancelled);
}

}  // namespace
}  // namespace flipfree::field::smoothest_test
