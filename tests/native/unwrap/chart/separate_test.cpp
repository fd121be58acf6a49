#include "flipfree/unwrap/chart/separate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/mesh/topology.h"
#include "support/shapes.h"
#include "unwrap/chart/bent_strip.h"

namespace flipfree::unwrap::separate_test {
namespace {

struct Cut {
  Index pieces = 0;
  Index edges = 0;
  std::vector<Index> piece_of;
};
Cut cut_of(const mesh::Surface& chart, const Points2& uv, double tolerated,
           const mesh::EdgeFlags& uncuttable = {}) {
  ExecutionContext context;
  mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(chart.vertices.rows()), chart.faces);
  const mesh::EdgeFlags flags =
      separating_cut(chart, adjacency, uv, overlapping_faces(chart.faces, uv, context), tolerated,
                     uncuttable, context);
  Cut cut;
  for (std::size_t h = 0; h < flags.size(); ++h) {
    if (!flags[h]) continue;
    EXPECT_TRUE(flags[static_cast<std::size_t>(adjacency.opposite[h])]);
    ++cut.edges;
    adjacency.opposite[h] = kInvalid;
  }
  cut.edges /= 2;
  const mesh::Components pieces = mesh::face_components(adjacency);
  cut.pieces = pieces.count;
  cut.piece_of = pieces.of_face;
  return cut;
}

TEST(SeparatingCut, divides_a_strip_that_lies_on_itself_across) {
  const mesh::Surface strip = test::grid(60, 2);
  const Cut cut = cut_of(strip, test::bent(strip, 1.5), 0.0);
  EXPECT_EQ(cut.pieces, 2);
  EXPECT_LE(cut.edges, 4);  // straight across are two edges, along a row of diagonals four
}

TEST(SeparatingCut, leaves_no_two_faces_of_a_piece_on_top_of_each_other) {
  const mesh::Surface strip = test::grid(90, 3);
  for (const double turns : {1.2, 1.9, 2.5, 3.7}) {
    const Points2 uv = test::bent(strip, turns);
    const Cut cut = cut_of(strip, uv, 0.0);
    EXPECT_GE(cut.pieces, static_cast<Index>(std::ceil(turns)));
    EXPECT_LE(cut.pieces, static_cast<Index>(std::ceil(turns)) + 1);
    for (const FacePair& pair : overlapping_faces(strip.faces, uv, ExecutionContext())) {
      EXPECT_NE(cut.piece_of[static_cast<std::size_t>(pair.first)],
                cut.piece_of[static_cast<std::size_t>(pair.second)]);
    }
  }
}

TEST(SeparatingCut, lets_be_what_is_tolerated) {
  const mesh::Surface strip = test::grid(60, 2);
  EXPECT_EQ(cut_of(strip, test::bent(strip, 1.05), 0.2).pieces, 1);
  EXPECT_EQ(cut_of(strip, test::bent(strip, 1.05), 0.0).pieces, 2);
}

TEST(SeparatingCut, spares_edges_that_shall_not_be_cut) {
  const mesh::Surface strip = test::grid(60, 2);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(strip.vertices.rows()), strip.faces);
  // Diagonals of the squares: neither along an axis.
  mesh::EdgeFlags diagonal(adjacency.opposite.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(diagonal.size()); ++h) {
    const Vector3 way = (strip.vertices.row(mesh::target(strip.faces, h)) -
                         strip.vertices.row(mesh::source(strip.faces, h)))
                            .transpose();
    diagonal[static_cast<std::size_t>(h)] = std::abs(way.x()) > 1e-9 && std::abs(way.y()) > 1e-9;
  }
  const Cut cut = cut_of(strip, test::bent(strip, 1.5), 0.0, diagonal);
  EXPECT_EQ(cut.pieces, 2);
  EXPECT_EQ(cut.edges, 2);
}

}  // namespace
}  // namespace flipfree::unwrap::separate_test
