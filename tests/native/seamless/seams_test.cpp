// Branches and transitions of surfaces of cubes, unfolded: their maps are seamless exactly.
#include "flipfree/seamless/seams.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "distortion/seams/polycubes.h"
#include "support/shapes.h"

namespace flipfree::seamless::seams_test {
namespace {

// Corners of cubes: vertices with other than four right angles.
std::vector<VertexId> cones_of(const test::Unfolded& u) {
  std::vector<double> angle(static_cast<std::size_t>(u.surface.vertices.rows()), 0.0);
  for (CornerId c = 0; c < static_cast<CornerId>(u.uv.rows()); ++c) {
    const Vector2 a = u.uv.row(next_corner(c)) - u.uv.row(c);
    const Vector2 b = u.uv.row(previous_corner(c)) - u.uv.row(c);
    angle[at(u.surface.faces(c / 3, c % 3))] +=
        std::atan2(std::abs(a.x() * b.y() - a.y() * b.x()), a.dot(b));
  }
  std::vector<VertexId> cones;
  for (std::size_t v = 0; v < angle.size(); ++v)
    if (std::abs(angle[v] - 2 * M_PI) > 0.1) cones.push_back(static_cast<VertexId>(v));
  return cones;
}

std::vector<SeamBranch> branches_of(const test::Unfolded& u) {
  return seam_branches(u.surface.faces, u.adjacency, u.cuts, cones_of(u), u.uv);
}

TEST(QuarterTurned, IsExactAndPeriodic) {
  const Vector2 p(3, 0.1);
  EXPECT_EQ(quarter_turned(p, 1), Vector2(-0.1, 3));
  for (Index k = -5; k < 6; ++k) {
    EXPECT_EQ(quarter_turned(quarter_turned(p, k), -k), p);
    EXPECT_EQ(quarter_turned(p, k + 4), quarter_turned(p, k));
  }
}

TEST(SeamBranches, HoldEveryCutEdgeOnceInChainsBetweenNodes) {
  for (const auto& cells : test::polycubes()) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const test::Unfolded u = test::unfold(cells, 3, seed);
      const Triangles& faces = u.surface.faces;
      std::map<VertexId, int> degree;  // of cut edges
      std::size_t cut = 0;
      for (std::size_t h = 0; h < u.cuts.size(); ++h) {
        if (u.cuts[h] == 0) continue;
        ++degree[mesh::source(faces, static_cast<HalfedgeId>(h))];
        ++cut;
      }
      for (const VertexId v : cones_of(u)) degree[v] += 100;
      std::set<HalfedgeId> edges;
      for (const SeamBranch& branch : branches_of(u)) {
        for (std::size_t i = 0; i < branch.halfedges.size(); ++i) {
          const HalfedgeId h = branch.halfedges[i];
          EXPECT_NE(u.cuts[at(h)], 0);
          EXPECT_TRUE(edges.insert(std::min(h, u.adjacency.opposite[at(h)])).second);
          if (i == 0) continue;
          EXPECT_EQ(mesh::target(faces, branch.halfedges[i - 1]), mesh::source(faces, h));
          EXPECT_EQ(degree[mesh::source(faces, h)], 2) << "a node inside a branch";
        }
        const VertexId first = mesh::source(faces, branch.halfedges.front());
        const VertexId last = mesh::target(faces, branch.halfedges.back());
        EXPECT_TRUE(first == last || (degree[first] != 2 && degree[last] != 2));
      }
      EXPECT_EQ(2 * edges.size(), cut);
    }
  }
}

TEST(SeamBranches, HaveTheTurnAndTheTranslationOfAnExactMap) {
  for (const auto& cells : test::polycubes()) {
    const test::Unfolded u = test::unfold(cells, 2, 7);
    const std::vector<SeamBranch> branches = branches_of(u);
    EXPECT_EQ(largest_seam_error(branches, u.adjacency, u.uv), 0.0);
    for (const SeamBranch& branch : branches) {
      for (const HalfedgeId h : branch.halfedges) {
        const HalfedgeId o = u.adjacency.opposite[at(h)];
        EXPECT_EQ(quarter_turned(u.uv.row(h).transpose(), branch.transition.quarter_turns) +
                      branch.transition.translation,
                  Vector2(u.uv.row(next_corner(o)).transpose()));
      }
    }
  }
}

TEST(SeamBranches, WhatAMapMissesItsSeamsByIsMeasured) {
  test::Unfolded u = test::unfold(test::polycubes()[1], 2, 3);
  const HalfedgeId h = branches_of(u).front().halfedges.front();
  u.uv.row(h) += Eigen::RowVector2d(0.003, 0.004);
  const double error = largest_seam_error(branches_of(u), u.adjacency, u.uv);
  EXPECT_LE(error, 0.005 + 1e-15);
  EXPECT_GE(error, 0.005 / 2 - 1e-15);  // the mean translation takes a share
}

// A torus cut along one loop, without cones: a closed chain without a node.
TEST(SeamBranches, AClosedChainBeginsAtItsLowestVertex) {
  const mesh::Surface torus = test::torus(8, 5);
  const mesh::Adjacency adjacency = mesh::build_adjacency(40, torus.faces);
  mesh::EdgeFlags cut(static_cast<std::size_t>(3 * torus.faces.rows()), 0);
  // One ring around, of eight vertices.
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    cut[at(h)] = mesh::source(torus.faces, h) / 8 == 2 && mesh::target(torus.faces, h) / 8 == 2;
  }
  const Points2 uv = Points2::Random(static_cast<Eigen::Index>(cut.size()), 2);
  const auto branches = seam_branches(torus.faces, adjacency, cut, {}, uv);
  ASSERT_EQ(branches.size(), 1U);
  VertexId lowest = 40;
  for (const HalfedgeId h : branches[0].halfedges)
    lowest = std::min(lowest, mesh::source(torus.faces, h));
  EXPECT_EQ(mesh::source(torus.faces, branches[0].halfedges.front()), lowest);
  EXPECT_EQ(mesh::target(torus.faces, branches[0].halfedges.back()), lowest);
}

TEST(WriteTransitions, ListsEveryCutEdgeWithItsBranchs) {
  const test::Unfolded u = test::unfold(test::polycubes()[2], 2, 1);
  const std::vector<SeamBranch> branches = branches_of(u);
  certify::Parametrization map;
  map.surface = u.surface;
  write_transitions(branches, map);
  ASSERT_EQ(map.cut_edges.rows(), static_cast<Eigen::Index>(map.transitions.size()));
  Eigen::Index row = 0;
  for (const SeamBranch& branch : branches) {
    for (const HalfedgeId h : branch.halfedges) {
      EXPECT_EQ(map.cut_edges(row, 0), mesh::source(u.surface.faces, h));
      EXPECT_EQ(map.cut_edges(row, 1), mesh::target(u.surface.faces, h));
      const certify::Transition& t = map.transitions[static_cast<std::size_t>(row++)];
      EXPECT_EQ(t.quarter_turns, branch.transition.quarter_turns);
      EXPECT_EQ(t.translation, branch.transition.translation);
    }
  }
  EXPECT_EQ(row, map.cut_edges.rows());
}

}  // namespace
}  // namespace flipfree::seamless::seams_test
