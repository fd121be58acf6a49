#include "flipfree/seamless/bordered/side_chords.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <random>
#include <set>

#include "flipfree/base/error.h"
#include "flipfree/mesh/topology.h"
#include "support/shapes.h"

namespace flipfree::seamless::side_chords_test {
namespace {

mesh::Adjacency adjacency_of(const mesh::Surface& surface) {
  return mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
}

std::set<std::set<VertexId>> chords_of(const mesh::Surface& surface,
                                       const std::vector<Index>& cones) {
  std::set<std::set<VertexId>> ends;
  ExecutionContext context;
  for (const HalfedgeId h : side_chords(surface.faces, adjacency_of(surface), cones, context))
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
  ExecutionContext context;
  const auto chords = side_chords(surface.faces, adjacency, cones, context);
  const DividedSurface pieces = split_in_the_middle(surface, adjacency, chords, cones);
  EXPECT_EQ(pieces.surface.vertices.rows(), 10);
  EXPECT_EQ(pieces.cones.size(), 10U);
  const mesh::Adjacency after = adjacency_of(pieces.surface);
  EXPECT_TRUE(mesh::topology(pieces.surface.faces, after).is_disk());
  EXPECT_TRUE(side_chords(pieces.surface.faces, after, pieces.cones, context).empty());
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

// The faces that an edge parts from those across it; all if it does not.
mesh::Surface beside(const mesh::Surface& surface, const mesh::Adjacency& adjacency, HalfedgeId h) {
  std::set<FaceId> part = {h / 3};
  std::vector<FaceId> queue = {h / 3};
  while (!queue.empty()) {
    const FaceId f = queue.back();
    queue.pop_back();
    for (HalfedgeId g = 3 * f; g < 3 * f + 3; ++g) {
      const HalfedgeId o = adjacency.opposite[at(g)];
      if (g != h && g != adjacency.opposite[at(h)] && o != kInvalid && part.insert(o / 3).second)
        queue.push_back(o / 3);
    }
  }
  mesh::Surface piece{surface.vertices, Triangles(static_cast<Eigen::Index>(part.size()), 3)};
  Eigen::Index row = 0;
  for (const FaceId f : part) piece.faces.row(row++) = surface.faces.row(f);
  return piece;
}

TEST(SplitInTheMiddle, NamesAnEdgeWithoutANumberBetweenItsEnds) {
  mesh::Surface surface = fanned_side();
  surface.vertices.col(0).array() += 1e16;  // even numbers only
  surface.vertices.col(1).setZero();
  const mesh::Adjacency adjacency = adjacency_of(surface);
  ExecutionContext context;
  const std::vector<Index> cones = {1, 1, 1, 1, 2, 2, 2};
  const auto chords = side_chords(surface.faces, adjacency, cones, context);
  try {
    split_in_the_middle(surface, adjacency, chords, cones);
    FAIL() << "divided";
  } catch (const NotConverged& failed) {
    EXPECT_EQ(failed.error().kind, ElementKind::kEdge);
    EXPECT_EQ(failed.error().elements, (std::vector<Index>{5, 0}));
  }
}

// Word by word as they are defined, each by itself.
std::set<std::set<VertexId>> slow_chords(const mesh::Surface& surface,
                                         const std::vector<Index>& cones) {
  const mesh::Adjacency adjacency = adjacency_of(surface);
  std::set<std::set<VertexId>> found;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[at(h)] == kInvalid) continue;
    const mesh::Surface piece = beside(surface, adjacency, h);
    const std::set<VertexId> ends = {mesh::source(surface.faces, h),
                                     mesh::target(surface.faces, h)};
    const mesh::Adjacency own = adjacency_of(piece);
    bool straight =
        piece.faces.rows() < surface.faces.rows() && mesh::topology(piece.faces, own).is_disk();
    for (const auto& loop : mesh::boundary_loops(piece.faces, own)) {
      for (const VertexId v : loop) straight = straight && (ends.count(v) > 0 || cones[at(v)] == 2);
    }
    if (straight) found.insert(ends);
  }
  return found;
}

// A disk without inner vertices, divided at random.
mesh::Surface random_polygon(Index corners, std::mt19937& random) {
  mesh::Surface s{Points3::Zero(corners, 3), Triangles(corners - 2, 3)};
  std::vector<VertexId> ring(at(corners));
  std::iota(ring.begin(), ring.end(), 0);
  for (Eigen::Index f = 0; f < s.faces.rows(); ++f) {
    const std::size_t n = ring.size(), i = random() % n;
    s.faces.row(f) << ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n];
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return s;
}

TEST(SideChords, AreThoseOfASearchOneByOneOnRandomPolygons) {
  std::mt19937 random(7);
  std::size_t found = 0;
  for (int round = 0; round < 300; ++round) {
    const mesh::Surface polygon = random_polygon(4 + static_cast<Index>(random() % 20), random);
    std::vector<Index> cones(at(static_cast<Index>(polygon.vertices.rows())), 2);
    for (int corners = 0; corners < 4; ++corners) cones[random() % cones.size()] = 1;
    const auto chords = slow_chords(polygon, cones);
    EXPECT_EQ(chords_of(polygon, cones), chords) << round;
    found += chords.size();
  }
  EXPECT_GT(found, 1000U);
}

// Between the middles of two sides that end far away there is no number.
TEST(SideChords, FacesTooThinToBeDividedAreNamed) {
  mesh::Surface fan;
  fan.vertices.resize(5, 3);
  fan.vertices << 1e20, 5e19, 0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 2, 0;
  fan.faces.resize(3, 3);
  fan.faces << 0, 1, 2, 0, 2, 3, 0, 3, 4;
  const mesh::Adjacency adjacency = adjacency_of(fan);
  const std::vector<HalfedgeId> both = {3, 6};  // 0-2 and 0-3
  try {
    split_in_the_middle(fan, adjacency, both, std::vector<Index>(5, 4));
    FAIL();
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().kind, ElementKind::kFace);
    EXPECT_EQ(e.error().elements, std::vector<Index>{1});
  }
  fan.vertices.row(0) << 4, 2, 0;
  EXPECT_EQ(split_in_the_middle(fan, adjacency, both, std::vector<Index>(5, 4)).cones.size(), 7U);
}

// A hundred thousand disks, each of which holds all smaller ones.
TEST(SideChords, OfALongFanAreFoundInTime) {
  const Index sides = 100000;
  mesh::Surface fan{Points3::Zero(sides, 3), Triangles(sides - 2, 3)};
  for (Index f = 0; f < sides - 2; ++f) fan.faces.row(f) << 0, f + 1, f + 2;
  std::vector<Index> cones(at(sides), 2);
  for (const Index v : {0, sides - 3, sides - 2, sides - 1}) cones[at(v)] = 1;
  ExecutionContext context;
  const TimeLimit limit(context, 20.0);
  EXPECT_EQ(side_chords(fan.faces, adjacency_of(fan), cones, context).size(), at(sides) - 4);
}

}  // namespace
}  // namespace flipfree::seamless::side_chords_test
