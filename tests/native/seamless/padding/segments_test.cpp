// Sides, segments and equalization of cuts drawn by hand on a grid torus.
#include "flipfree/seamless/padding/segments.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/base/error.h"
#include "seamless/padding/cuts.h"

namespace flipfree::seamless::segments_test {
namespace {

using test::Chain;
using test::drawn_cut;
using test::GridTorus;

mesh::Adjacency adjacency_of(const AdmissibleCut& cut) {
  return mesh::build_adjacency(static_cast<Index>(cut.surface.vertices.rows()), cut.surface.faces);
}

Chain row(const GridTorus& t, Index j, Index from, Index to) {
  Chain chain;
  for (Index i = from; i <= to; ++i) chain.push_back(t.at(i, j));
  return chain;
}
Chain column(const GridTorus& t, Index i, Index from, Index to) {
  Chain chain;
  for (Index j = from; j <= to; ++j) chain.push_back(t.at(i, j));
  return chain;
}

// One node, one square.
AdmissibleCut square(const GridTorus& t) {
  return drawn_cut(t.surface, {row(t, 0, 0, t.sectors), column(t, 0, 0, t.rows)}, {});
}

// A T-node on the row and one on the column, joined by a path that turns once: 3 and 5 corners.
AdmissibleCut two_t_nodes(const GridTorus& t) {
  Chain path = column(t, 4, 0, 4);
  for (Index i = 3; i >= 0; --i) path.push_back(t.at(i, 4));
  AdmissibleCut cut = drawn_cut(
      t.surface,
      {row(t, 0, 0, 4), row(t, 0, 4, t.sectors), column(t, 0, 0, 4), column(t, 0, 4, t.rows), path},
      {{t.at(4, 0), t.at(3, 0)}, {t.at(0, 4), t.at(0, 5)}});
  cut.extra_path = 4;
  return cut;
}

// Both nodes on the row, two paths from one to the other that leave upwards and arrive from below:
// 2 and 6 corners.
AdmissibleCut digon(const GridTorus& t) {
  const Chain left = {t.at(2, 0), t.at(2, 1), t.at(2, 2), t.at(2, 3), t.at(2, 4), t.at(3, 4),
                      t.at(4, 4), t.at(5, 4), t.at(5, 5), t.at(5, 6), t.at(5, 7), t.at(6, 8)};
  const Chain right = {t.at(2, 0), t.at(3, 1), t.at(3, 2), t.at(3, 3), t.at(4, 3), t.at(5, 3),
                       t.at(6, 3), t.at(6, 4), t.at(6, 5), t.at(6, 6), t.at(6, 7), t.at(6, 8)};
  return drawn_cut(t.surface, {row(t, 0, 2, 6), row(t, 0, 6, 10), left, right}, {});
}

TEST(Segments, SidesOfASquareTorusGoAroundIt) {
  const GridTorus torus(8, 8);
  const AdmissibleCut cut = square(torus);
  const mesh::Adjacency adjacency = adjacency_of(cut);
  const CutSegments segments = cut_segments(cut, adjacency);
  ASSERT_EQ(segments.component_count(), 1);
  ASSERT_EQ(segments.size(0), 4);
  // Along the row, up the column's left side, back below the row, down the column's right side.
  std::vector<Index> around;
  for (Index i = 0; i < 4; ++i) {
    ASSERT_EQ(segments.segments[static_cast<std::size_t>(i)].sides.size(), 1u);
    around.push_back(segments.segments[static_cast<std::size_t>(i)].sides.front());
    EXPECT_EQ(segments.previous(segments.next(i)), i);
  }
  std::rotate(around.begin(), std::find(around.begin(), around.end(), 0), around.end());
  EXPECT_EQ(around, (std::vector<Index>{0, 2, 1, 3}));
  for (const Index side : {0, 1, 2, 3}) {
    const auto chain = side_halfedges(cut, adjacency, side);
    EXPECT_EQ(chain.size(), 8u);
    EXPECT_EQ(chain.front() == cut.branches[static_cast<std::size_t>(side / 2)].front(),
              side % 2 == 0);
  }
}

TEST(Segments, NothingCanBeEqualizedOnOneSquare) {
  const AdmissibleCut cut = square(GridTorus(6, 5));
  const EqualizationSystem system = equalization_system(cut, cut_segments(cut, adjacency_of(cut)));
  EXPECT_EQ(system.unknowns, 4);
  ASSERT_EQ(system.rows.size(), 2u);
  // Every pair of opposite sides changes alike, whatever is padded.
  for (const EqualizationRow& row : system.rows) EXPECT_TRUE(row.terms.empty());
}

TEST(Segments, FlatSectorsJoinSides) {
  const GridTorus torus(8, 8);
  const AdmissibleCut cut = two_t_nodes(torus);
  const CutSegments segments = cut_segments(cut, adjacency_of(cut));
  ASSERT_EQ(segments.component_count(), 2);
  EXPECT_EQ(std::min(segments.size(0), segments.size(1)), 3);
  EXPECT_EQ(std::max(segments.size(0), segments.size(1)), 5);
  const auto sides_of = [&](Index side) {
    return segments
        .segments[static_cast<std::size_t>(segments.of_side[static_cast<std::size_t>(side)])]
        .sides;
  };
  EXPECT_EQ(sides_of(1), (std::vector<Index>{3, 1}));  // below the row, from right to left
  EXPECT_EQ(sides_of(4), (std::vector<Index>{4, 6}));  // left of the column, upwards
  for (const Index side : {0, 2, 5, 7, 8, 9}) EXPECT_EQ(sides_of(side).size(), 1u);
}

TEST(Segments, RowsOfComplexSegmentsSumTheirMates) {
  const GridTorus torus(8, 8);
  const AdmissibleCut cut = two_t_nodes(torus);
  const CutSegments segments = cut_segments(cut, adjacency_of(cut));
  const EqualizationSystem system = equalization_system(cut, segments);
  const auto segment = [&](Index side) { return segments.of_side[static_cast<std::size_t>(side)]; };
  ASSERT_EQ(system.rows.size(), 3u);
  EXPECT_EQ(system.unpadded, (std::vector<Index>{segment(8), segment(9)}));
  for (const EqualizationRow& row : system.rows) {
    if (row.segment != segment(1)) continue;
    EXPECT_EQ(row.mates, (std::vector<Index>{segment(2), segment(0)}));
    // Below the row, between both sides of the column: +5 +4. Above it: left piece between the
    // column's right side and the path's left one, right piece between the path's right one and
    // the column's left one: -5 -8, -9 -4. The path goes up from the row: 8 is its left side.
    std::vector<std::pair<Index, Index>> terms = {
        {segment(7), 1}, {segment(5), -1}, {segment(8), -1}, {segment(9), -1}};
    std::sort(terms.begin(), terms.end());
    EXPECT_EQ(row.terms, terms);
    return;
  }
  FAIL() << "no row of the complex segment";
}

TEST(Segments, EqualizationNeedsComponentsWithoutFourfoldCorners) {
  const AdmissibleCut cut = digon(GridTorus(8, 8));
  const CutSegments segments = cut_segments(cut, adjacency_of(cut));
  ASSERT_EQ(segments.component_count(), 2);
  EXPECT_EQ(segments.size(0) * segments.size(1), 12);
  const EqualizationSystem system = equalization_system(cut, segments);
  EXPECT_EQ(system.rows.size(), 4u);
  EXPECT_EQ(test::rank_of(system, true), 4);
  EXPECT_TRUE(test::ones_are_in_kernel(system));
}

TEST(Segments, NoBranchesAreOneComponentWithoutSegments) {
  AdmissibleCut cut;
  cut.surface = GridTorus(4, 4).surface;
  const CutSegments segments = cut_segments(cut, adjacency_of(cut));
  EXPECT_EQ(segments.component_count(), 1);
  EXPECT_TRUE(segments.segments.empty());
  EXPECT_TRUE(equalization_system(cut, segments).rows.empty());
}

TEST(Segments, CutsThatAreNoneAreNamed) {
  const GridTorus torus(8, 8);
  // One loop alone leaves an annulus, without a corner.
  AdmissibleCut loop = drawn_cut(torus.surface, {row(torus, 0, 0, 8)}, {});
  EXPECT_THROW(cut_segments(loop, adjacency_of(loop)), InternalError);
  // Both sides flat.
  AdmissibleCut twice = two_t_nodes(torus);
  twice.flat_sectors.push_back(
      test::halfedges_of(torus.surface.faces).at({torus.at(0, 0), torus.at(1, 0)}));
  const CutSegments segments = cut_segments(twice, adjacency_of(twice));
  EXPECT_THROW(equalization_system(twice, segments), InternalError);
  // A branch that is crossed where it has no node.
  const AdmissibleCut crossed =
      drawn_cut(torus.surface, {row(torus, 0, 0, 8), column(torus, 3, 0, 8)}, {});
  EXPECT_THROW(cut_segments(crossed, adjacency_of(crossed)), InternalError);
}

}  // namespace
}  // namespace flipfree::seamless::segments_test
