#include "flipfree/matchmaker/request/constraints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::contradictions_test {
namespace {

// A grid with its boundary on a circle, the vertices inside where the grid has them.
class Circle : public testing::Test {
 protected:
  Circle() : surface_(test::grid(6, 6)), refined_(mesh::make_refined_surface(surface_)) {
    const auto n = static_cast<double>(refined_.boundary.size());
    for (std::size_t i = 0; i < refined_.boundary.size(); ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / n;
      constraints_.outline.emplace_back(std::cos(angle), std::sin(angle));
    }
  }

  // Reads them as a caller gives them.
  Constraints read(SelfOverlaps overlaps = SelfOverlaps::kRefused) {
    MatchRequest request;
    request.points = constraints_.pins;
    request.boundary_uv = constraints_.outline;
    for (const auto& [a, b] : constraints_.edges) request.lines.push_back({{a, b}, {at(a), at(b)}});
    return read_constraints(refined_, request, overlaps);
  }
  Vector2 at(VertexId v) const {
    return std::find_if(constraints_.pins.begin(), constraints_.pins.end(),
                        [&](const PinnedVertex& p) { return p.vertex == v; })
        ->uv;
  }

  Error refusal() {
    try {
      read();
    } catch (const Infeasible& failure) {
      EXPECT_FALSE(failure.error().witness.rule.empty()) << failure.what();
      return failure.error();
    }
    ADD_FAILURE() << "accepted";
    return {};
  }

  mesh::Surface surface_;
  mesh::RefinedSurface refined_;
  Constraints constraints_;
};

TEST_F(Circle, IsSimpleAndTurnsOnce) {
  constraints_.pins = {{24, {0.1, 0.2}}, {25, {-0.3, 0.2}}};
  const Constraints circle = read();
  EXPECT_EQ(circle.turning_number, 1);
  EXPECT_TRUE(circle.simple_outline);
}

TEST_F(Circle, RefusesAnOutlineThatRunsClockwise) {
  for (Vector2& p : constraints_.outline) p.y() = -p.y();
  EXPECT_EQ(refusal().witness.rule, "turning number");
}

TEST_F(Circle, RefusesTwoPinsAtOnePointAsStored) {
  constraints_.pins = {{24, {0.1, 0.2}}, {25, {0.1, std::nextafter(0.2, 1.0)}}};
  const Error error = refusal();
  EXPECT_EQ(error.witness.rule, "same place");
  EXPECT_EQ(error.elements, (std::vector<Index>{24, 25}));
}

TEST_F(Circle, RefusesAPinOutside) {
  constraints_.pins = {{24, {1.1, 0.0}}};
  EXPECT_EQ(refusal().witness.rule, "outside");
}

TEST_F(Circle, RefusesLinesThatCrossEachOtherOrTheOutline) {
  constraints_.pins = {{8, {-0.5, 0.0}}, {9, {0.5, 0.0}}, {22, {0.0, -0.5}}, {23, {0.0, 0.5}}};
  constraints_.edges = {{8, 9}, {22, 23}};
  const Error crossing = refusal();
  EXPECT_EQ(crossing.witness.rule, "segments meet");
  for (const Index v : {8, 9, 22, 23})
    EXPECT_TRUE(std::count(crossing.elements.begin(), crossing.elements.end(), v) == 1) << v;
}

TEST_F(Circle, WhereOverlapsAreAllowedPinsThatMeetProveNothing) {
  constraints_.outline.clear();
  constraints_.pins = {{24, {0.1, 0.2}}, {25, {0.1, 0.2}}};
  EXPECT_THROW(read(SelfOverlaps::kAllowed), NotConverged);
  EXPECT_EQ(refusal().witness.rule, "same place");
}

TEST_F(Circle, AClosedLineKeepsItsSense) {
  const std::vector<VertexId> around = {16, 17, 24, 23, 16};
  const Polygon square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
  const Polygon mirrored(square.rbegin(), square.rend());
  MatchRequest request;
  request.lines = {{around, square}};
  EXPECT_NO_THROW(read_constraints(refined_, request));
  request.lines = {{around, mirrored}};
  EXPECT_THROW(read_constraints(refined_, request), Infeasible);
}

}  // namespace
}  // namespace flipfree::matchmaker::contradictions_test
