#include "flipfree/seamless/exact/parts.h"

#include <gtest/gtest.h>

#include <set>

#include "flipfree/seamless/bordered/side_chords.h"
#include "support/shapes.h"

namespace flipfree::seamless::divided_sides_test {
namespace {

mesh::Adjacency adjacency_of(const mesh::Surface& surface) {
  return mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
}

// Four corners and a side with the vertices 4, 5, 6 between 0 and 1, fanned from 0.
mesh::Surface fanned_side() {
  mesh::Surface s;
  s.vertices.resize(7, 3);
  s.vertices << 0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 1, -0.5, 0, 2, -0.7, 0, 3, -0.5, 0;
  s.faces.resize(5, 3);
  s.faces << 0, 4, 5, 0, 5, 6, 0, 6, 1, 0, 1, 2, 0, 2, 3;
  return s;
}

std::set<std::set<VertexId>> as_set(const IndexPairs& pairs) {
  std::set<std::set<VertexId>> set;
  for (Eigen::Index i = 0; i < pairs.rows(); ++i) set.insert({pairs(i, 0), pairs(i, 1)});
  return set;
}

TEST(DividedSides, IsNothingWhereNoEdgeIsFlattened) {
  const mesh::Surface sheet = test::grid(4, 3);
  std::vector<Index> cones(at(static_cast<Index>(sheet.vertices.rows())), 4);
  // Corners everywhere: no side has a vertex inside.
  for (Index& k : cones) k = 1;
  ExecutionContext context;
  EXPECT_FALSE(divided_sides(sheet, adjacency_of(sheet), cones, IndexPairs(0, 2), context));
}

TEST(DividedSides, KeepsDiagonalsAndPlaces) {
  const mesh::Surface surface = fanned_side();
  const std::vector<Index> cones = {1, 1, 1, 1, 2, 2, 2};
  // One that is divided (0-5), one that is not (0-2).
  IndexPairs diagonals(2, 2);
  diagonals << 5, 0, 0, 2;
  ExecutionContext context;
  const auto divided = divided_sides(surface, adjacency_of(surface), cones, diagonals, context);
  ASSERT_TRUE(divided);
  const DividedSurface& pieces = divided->pieces;
  ASSERT_EQ(pieces.surface.vertices.rows(), 10);
  const mesh::Adjacency adjacency = adjacency_of(pieces.surface);
  EXPECT_TRUE(side_chords(pieces.surface.faces, adjacency, pieces.cones, context).empty());
  // Places are ends of the edges that new vertices lie on.
  ASSERT_EQ(divided->place.size(), 10U);
  for (VertexId v = 0; v < 7; ++v) EXPECT_EQ(divided->place[at(v)], v);
  for (VertexId v = 7; v < 10; ++v) {
    const mesh::SurfacePoint& point = pieces.provenance.vertex[at(v)];
    double weight = 0.0;
    for (int k = 0; k < 3; ++k) {
      if (surface.faces(point.face, k) == divided->place[at(v)]) weight = point.weight[k];
    }
    EXPECT_EQ(weight, 0.5);
  }
  // What may not be cut: both halves of 0-5, 0-2, and every edge inside a face of the input.
  const std::set<std::set<VertexId>> kept = as_set(divided->uncuttable);
  EXPECT_EQ(kept.count({0, 2}), 1U);
  EXPECT_EQ(kept.count({0, 5}), 0U);
  std::size_t inside = 0;
  for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || o < h) continue;
    const std::set<VertexId> edge = {mesh::source(pieces.surface.faces, h),
                                     mesh::target(pieces.surface.faces, h)};
    const bool same = pieces.provenance.face[at(h / 3)] == pieces.provenance.face[at(o / 3)];
    inside += same ? 1U : 0U;
    EXPECT_TRUE(!same || kept.count(edge) == 1);
  }
  EXPECT_EQ(inside, 6U);  // three edges divided, each in two faces
  VertexId middle = 7;
  const auto lies_on = [&](VertexId v, double x, double y) {
    return pieces.surface.vertices(v, 0) == x && pieces.surface.vertices(v, 1) == y;
  };
  while (middle < 10 && !lies_on(middle, 1.0, -0.35)) ++middle;
  ASSERT_LT(middle, 10);
  EXPECT_EQ(kept.count({0, middle}), 1U);
  EXPECT_EQ(kept.count({5, middle}), 1U);
}

}  // namespace
}  // namespace flipfree::seamless::divided_sides_test
