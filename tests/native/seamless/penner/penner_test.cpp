// Seamless maps in doubles: certificates, branches and transitions, components.
#include "flipfree/seamless/penner/penner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::seamless::penner_test {
namespace {

std::vector<Index> spread_cones(const mesh::Surface& surface, Index genus, Index count) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  const Index sharp = (count + 8 - 8 * genus) / 2;
  const std::size_t stride = cones.size() / at(count);
  for (Index i = 0; i < count; ++i) cones[at(i) * stride] = i < sharp ? 3 : 5;
  return cones;
}

PennerMap solve(const mesh::Surface& surface, const std::vector<Index>& cones) {
  ExecutionContext context;
  return compute_penner_map(surface, cones, {}, {}, context);
}

void expect_transitions(const PennerMap& result) {
  const certify::Parametrization& map = result.map;
  ASSERT_EQ(map.transitions.size(), static_cast<std::size_t>(map.cut_edges.rows()));
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  std::size_t edge = 0;
  for (const SeamBranch& branch : result.branches) {
    for (std::size_t i = 0; i < branch.halfedges.size(); ++i, ++edge) {
      const HalfedgeId h = branch.halfedges[i];
      EXPECT_EQ(map.cut_edges(static_cast<Eigen::Index>(edge), 0),
                mesh::source(map.surface.faces, h));
      EXPECT_EQ(map.cut_edges(static_cast<Eigen::Index>(edge), 1),
                mesh::target(map.surface.faces, h));
      const HalfedgeId o = adjacency.opposite[at(h)];
      const Vector2 first = map.uv.row(h), second = map.uv.row(next_corner(o));
      const certify::Transition& t = map.transitions[edge];
      EXPECT_LE((second - quarter_turned(first, t.quarter_turns) - t.translation).norm(), 1e-11);
      if (i > 0) {
        EXPECT_EQ(mesh::source(map.surface.faces, h),
                  mesh::target(map.surface.faces, branch.halfedges[i - 1]));
      }
    }
  }
  EXPECT_EQ(edge, map.transitions.size());
  EXPECT_LE(result.seam_error, 1e-11);
}

TEST(PennerMap, IsCertifiedAndSeamlessUpToRounding) {
  for (Index genus = 0; genus <= 3; ++genus) {
    const mesh::Surface surface =
        genus == 0 ? test::sphere(24, 16) : test::perforated_plate(genus, 4);
    const PennerMap result = solve(surface, spread_cones(surface, genus, 24));
    EXPECT_TRUE(result.map.certificate.ok) << genus;
    EXPECT_FALSE(result.not_stored);
    expect_transitions(result);
  }
}

// Around a cone or node the turns of the branches that leave it add up to its angle.
TEST(PennerMap, SphereOfEightCornersHasOneTreeOfBranches) {
  const mesh::Surface surface = test::sphere(24, 16);
  const auto cones = spread_cones(surface, 0, 8);
  const PennerMap result = solve(surface, cones);
  expect_transitions(result);
  // A tree: ends in cones. Across the branch at a leaf the map is turned around the cone by it.
  std::vector<Index> leaves(cones.size(), 0);
  for (const SeamBranch& branch : result.branches) {
    for (const VertexId v : {mesh::source(result.map.surface.faces, branch.halfedges.front()),
                             mesh::target(result.map.surface.faces, branch.halfedges.back())}) {
      if (at(v) < cones.size()) ++leaves[at(v)];
    }
  }
  for (const SeamBranch& branch : result.branches) {
    const VertexId a = mesh::source(result.map.surface.faces, branch.halfedges.front());
    const VertexId b = mesh::target(result.map.surface.faces, branch.halfedges.back());
    if (leaves[at(a)] == 1 || leaves[at(b)] == 1) {
      EXPECT_EQ(branch.transition.quarter_turns % 2, 1);
    }
  }
}

TEST(PennerMap, ComponentsOfDifferentGenusInOneCall) {
  const mesh::Surface a = test::sphere(12, 8), b = test::perforated_plate(2, 3);
  mesh::Surface both;
  both.vertices.resize(a.vertices.rows() + b.vertices.rows(), 3);
  both.vertices << b.vertices, (a.vertices.array() + 20.0).matrix();
  both.faces.resize(a.faces.rows() + b.faces.rows(), 3);
  both.faces << (a.faces.array() + static_cast<Index>(b.vertices.rows())).matrix(), b.faces;
  std::vector<Index> cones = spread_cones(b, 2, 20);
  const std::vector<Index> more = spread_cones(a, 0, 10);
  cones.insert(cones.end(), more.begin(), more.end());
  const PennerMap result = solve(both, cones);
  EXPECT_TRUE(result.map.certificate.ok);
  EXPECT_EQ(result.map.certificate.island_overlaps, 0);
  EXPECT_EQ(result.loops.size(), 4u);
  for (const LoopTurn& loop : result.loops) {
    for (const HalfedgeId h : loop.loop) EXPECT_GE(h / 3, static_cast<Index>(a.faces.rows()));
  }
  expect_transitions(result);
  EXPECT_EQ(result.map.parent_face.size(),
            static_cast<std::size_t>(result.map.surface.faces.rows()));
}

TEST(PennerMap, SumsOfAComponentThatDoNotFitAreRefused) {
  const mesh::Surface surface = test::sphere(12, 8);
  const std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  EXPECT_THROW(solve(surface, cones), Infeasible);
  EXPECT_THROW(solve(surface, {3, 3}), InvalidInput);
}

}  // namespace
}  // namespace flipfree::seamless::penner_test
