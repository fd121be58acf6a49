#include "flipfree/matchmaker/target/sheet_target.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::sheet_target_test {
namespace {

// A ribbon that winds one and a half times and lies on itself in the first and the last third.
constexpr Index kColumns = 40;
constexpr Index kRows = 4;

Vector2 spiral(double along, double radius) {
  const double angle = 3 * std::numbers::pi * along;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

VertexId vertex(Index column, Index row) { return row * (kColumns + 1) + column; }

SheetTarget with_lines(const mesh::Surface& surface, const std::vector<PinnedLine>& lines) {
  mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  MatchRequest request;
  request.lines = lines;
  request.boundary_loop = refined.boundary;
  for (const VertexId v : refined.boundary) {
    const double along = surface.vertices(v, 0);
    request.boundary_uv.push_back(spiral(along, 2 - surface.vertices(v, 1) + 0.45 * along));
  }
  ExecutionContext context;
  return sheet_target(refined, read_constraints(refined, request), context);
}

TEST(SheetTarget, LinesThatCrossOnOneSheetAreNamed) {
  const mesh::Surface surface = test::grid(kColumns, kRows);
  const double left = 20.0 / kColumns;
  const double right = 21.0 / kColumns;
  try {
    with_lines(surface,
               {{{vertex(20, 1), vertex(21, 1)}, {spiral(left, 1.6), spiral(right, 1.4)}},
                {{vertex(20, 3), vertex(21, 3)}, {spiral(left, 1.4), spiral(right, 1.6)}}});
    FAIL() << "accepted";
  } catch (const Infeasible& refusal) {
    EXPECT_NE(refusal.error().message.find("on one sheet"), std::string::npos)
        << refusal.error().message;
    EXPECT_EQ(refusal.error().elements.size(), 4u);
  }
  EXPECT_NO_THROW(with_lines(
      surface, {{{vertex(20, 1), vertex(21, 1)}, {spiral(left, 1.6), spiral(right, 1.6)}},
                {{vertex(20, 3), vertex(21, 3)}, {spiral(left, 1.4), spiral(right, 1.4)}}}));
}

TEST(SheetTarget, LinesThatCrossOnDifferentSheetsAreNot) {
  const mesh::Surface surface = test::grid(kColumns, kRows);
  // From the outer boundary of the first turn, and from the inner one of the second above it.
  const Index first = 7;
  const Index second = 33;
  const auto along = [](Index column) { return static_cast<double>(column) / kColumns; };
  const Vector2 start = spiral(along(first), 2 + 0.45 * along(first));
  const Vector2 other = spiral(along(second), 1 + 0.45 * along(second));
  const Vector2 end = spiral(along(first), 1.5);
  const Vector2 last = start + 0.5 * (end - start) + 0.2 * (start + 0.5 * (end - start) - other);
  EXPECT_NO_THROW(with_lines(surface, {{{vertex(first, 0), vertex(first, 1)}, {start, end}},
                                       {{vertex(second, 4), vertex(second, 3)}, {other, last}}}));
}

}  // namespace
}  // namespace flipfree::matchmaker::sheet_target_test
