#include "flipfree/seamless/bordered/side_chords.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "flipfree/mesh/topology.h"
#include "support/shapes.h"

namespace flipfree::seamless {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

mesh::Adjacency adjacency_of(const mesh::Surface& surface) {
  return mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
}

std::set<std::set<VertexId>> chords_of(const mesh::Surface& surface,
                                       const std::vector<Index>& cones) {
  std::set<std::set<VertexId>> ends;
  for (const HalfedgeId h : side_chords(surface.faces, adjacency_of(surface), cones))
    ends.insert({mesh::source(surface.faces, h), mesh::target(surface.faces, h)});
  return ends;
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

TEST(SideChords, AreEdgesBetweenVerticesOfOneSide) {
  const mesh::Surface surface = fanned_side();
  EXPECT_EQ(chords_of(surface, {1, 1, 1, 1, 2, 2, 2}),
            (std::set<std::set<VertexId>>{{0, 5}, {0, 6}, {0, 1}}));
  // A corner at vertex 5 leaves what lies beyond it.
  EXPECT_EQ(chords_of(surface, {1, 1, 1, 1, 2, 1, 2}), (std::set<std::set<VertexId>>{{0, 5}}));
}

TEST(SideChords, AreNotEdgesAroundAHole) {
  // Three vertices in the middle, three outside, no corners: every edge between outer vertices is
  // one of the boundary, every other one leads from curve to curve.
  const mesh::Surface ring = test::cylinder(3, 1);
  EXPECT_TRUE(chords_of(ring, std::vector<Index>(6, 2)).empty());
}

TEST(SideChords, AreNotThereWhereNothingIsGiven) {
  EXPECT_TRUE(chords_of(fanned_side(), std::vector<Index>(7, 0)).empty());
}

TEST(SideChords, MayHaveVerticesBehindThem) {
  // A square whose lower side has vertex 4, and vertex 5 inside of what the edge 0 - 1 cuts off.
  mesh::Surface s;
  s.vertices.resize(6, 3);
  s.vertices << 0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 2, -2, 0, 2, -1, 0;
  s.faces.resize(5, 3);
  s.faces << 0, 4, 5, 4, 1, 5, 0, 5, 1, 0, 1, 2, 0, 2, 3;
  EXPECT_EQ(chords_of(s, {1, 1, 1, 1, 2, 4}), (std::set<std::set<VertexId>>{{0, 1}}));
}

TEST(SplitInTheMiddle, LeavesASurfaceWithoutSideChordsOnTheSameFaces) {
  const mesh::Surface surface = fanned_side();
  const std::vector<Index> cones = {1, 1, 1, 1, 2, 2, 2};
  const mesh::Adjacency adjacency = adjacency_of(surface);
  const DividedSurface pieces =
      split_in_the_middle(surface, adjacency, side_chords(surface.faces, adjacency, cones), cones);
  EXPECT_EQ(pieces.surface.vertices.rows(), 10);
  EXPECT_EQ(pieces.cones.size(), 10U);
  const mesh::Adjacency after = adjacency_of(pieces.surface);
  EXPECT_TRUE(mesh::topology(pieces.surface.faces, after).is_disk());
  EXPECT_TRUE(side_chords(pieces.surface.faces, after, pieces.cones).empty());
  // Every vertex lies where its provenance says, and every face turns as its parent does.
  for (Eigen::Index v = 0; v < 10; ++v) {
    const mesh::SurfacePoint& point = pieces.provenance.vertex[static_cast<std::size_t>(v)];
    Vector3 place = Vector3::Zero();
    for (int k = 0; k < 3; ++k)
      place += point.weight[k] * surface.vertices.row(surface.faces(point.face, k)).transpose();
    EXPECT_TRUE(place == Vector3(pieces.surface.vertices.row(v))) << v;
  }
  std::vector<double> area(5, 0.0);
  const auto area_of = [](const mesh::Surface& s, Eigen::Index f) {
    const Vector3 p = s.vertices.row(s.faces(f, 0));
    const Vector3 a = s.vertices.row(s.faces(f, 1)).transpose() - p;
    const Vector3 b = s.vertices.row(s.faces(f, 2)).transpose() - p;
    return 0.5 * a.cross(b).z();
  };
  for (Eigen::Index f = 0; f < pieces.surface.faces.rows(); ++f) {
    EXPECT_GT(area_of(pieces.surface, f), 0.0);
    area[at(pieces.provenance.face[static_cast<std::size_t>(f)])] += area_of(pieces.surface, f);
  }
  for (Eigen::Index f = 0; f < 5; ++f)
    EXPECT_DOUBLE_EQ(area[at(static_cast<Index>(f))], area_of(surface, f));
}

}  // namespace
}  // namespace flipfree::seamless
