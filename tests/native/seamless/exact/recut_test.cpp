#include "flipfree/seamless/exact/take_back.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "flipfree/certify/certify.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "flipfree/seamless/padding/padding.h"
#include "flipfree/seamless/padding/topology.h"
#include "flipfree/seamless/seams.h"
#include "support/shapes.h"

namespace flipfree::seamless::recut_test {
namespace {

// A torus with four cones, and the map that padding makes: its cut runs through faces.
struct Padded {
  mesh::Surface surface = test::torus(24, 16);
  mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  std::vector<Index> turns;
  std::vector<VertexId> cones = {5, 100, 200, 300};
  certify::Parametrization map;

  Padded() : turns(static_cast<std::size_t>(surface.vertices.rows()), 4) {
    for (std::size_t i = 0; i < cones.size(); ++i)
      turns[static_cast<std::size_t>(cones[i])] = i < 2 ? 3 : 5;
    ExecutionContext context;
    map = compute_padding_map(
              surface, turns,
              [](const mesh::Surface& component, const std::vector<Index>& own,
                 const std::vector<FaceId>&,
                 ExecutionContext& inner) { return make_admissible_cut(component, own, inner); },
              {}, context)
              .map;
  }
};

double corner_angle(const Points2& uv, CornerId c) {
  const Vector2 p = uv.row(c);
  const Vector2 a = uv.row(next_corner(c)).transpose() - p;
  const Vector2 b = uv.row(previous_corner(c)).transpose() - p;
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

TEST(Recut, PutsTheCornersOfAFaceWhereTheMapHasThem) {
  const Padded padded;
  ASSERT_GT(padded.map.surface.vertices.rows(), padded.surface.vertices.rows());
  const ExecutionContext context;
  const certify::Parametrization own =
      on_own_triangles(padded.surface, padded.adjacency, padded.cones, {}, padded.map, context);
  EXPECT_TRUE(own.surface.faces == padded.surface.faces);
  const double extent = (own.uv.colwise().maxCoeff() - own.uv.colwise().minCoeff()).maxCoeff();
  // Faces that the engine left whole have their sides and angles.
  Index whole = 0;
  for (FaceId f = 0; f < static_cast<FaceId>(padded.map.surface.faces.rows()); ++f) {
    const FaceId parent = padded.map.parent_face[static_cast<std::size_t>(f)];
    if (padded.map.surface.faces.row(f) != padded.surface.faces.row(parent)) continue;
    ++whole;
    for (int k = 0; k < 3; ++k) {
      const CornerId c = 3 * f + k, d = 3 * parent + k;
      const double side = (padded.map.uv.row(next_corner(c)) - padded.map.uv.row(c)).norm();
      EXPECT_NEAR((own.uv.row(next_corner(d)) - own.uv.row(d)).norm(), side, 1e-10 * extent);
      EXPECT_NEAR(corner_angle(own.uv, d), corner_angle(padded.map.uv, c), 1e-6);
    }
  }
  EXPECT_GT(whole, 10);
}

TEST(Recut, ItsSeamsMatchAndReachAllCones) {
  const Padded padded;
  const ExecutionContext context;
  const certify::Parametrization own =
      on_own_triangles(padded.surface, padded.adjacency, padded.cones, {}, padded.map, context);
  const mesh::EdgeFlags cut =
      mesh::flag_edges(padded.surface.faces, padded.adjacency, own.cut_edges);
  const auto branches =
      seam_branches(padded.surface.faces, padded.adjacency, cut, padded.cones, own.uv);
  const double extent = (own.uv.colwise().maxCoeff() - own.uv.colwise().minCoeff()).maxCoeff();
  EXPECT_LE(largest_seam_error(branches, padded.adjacency, own.uv), 1e-10 * extent);
  // Edges that are not cut have the same ends on both sides.
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (cut[static_cast<std::size_t>(h)] != 0) continue;
    const HalfedgeId o = padded.adjacency.opposite[static_cast<std::size_t>(h)];
    EXPECT_LE((own.uv.row(h) - own.uv.row(next_corner(o))).norm(), 1e-10 * extent);
  }
  std::vector<char> reached(padded.turns.size(), 0);
  for (const Index v : own.cut_edges.reshaped()) reached[static_cast<std::size_t>(v)] = 1;
  for (const VertexId v : padded.cones) EXPECT_EQ(reached[static_cast<std::size_t>(v)], 1);
}

TEST(Recut, APaddedMapComesBackToTheUsersTriangles) {
  Padded padded;
  SeamlessOptions options;
  options.which = Engine::kPadding;
  ExecutionContext context;
  const certify::Parametrization map =
      compute_seamless_map(padded.surface, padded.turns, options, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(map.surface.vertices.rows(), padded.surface.vertices.rows());
  EXPECT_GT(std::get<std::int64_t>(map.stats.at("engine.added_vertices")), 0);
  EXPECT_EQ(map.certificate.seams_exact32, map.certificate.seam_edges);
}

}  // namespace
}  // namespace flipfree::seamless::recut_test
