#include "flipfree/distortion/seams/relief.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "distortion/seams/polycubes.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/seams/seam_system.h"

namespace flipfree::distortion::relief_test {
namespace {

struct Crowded {
  CutMap map;
  SeamConstraints constraints;
  RestShapes rest;
  VertexId moved = kInvalid;
};

// A bar's surface in small triangles, laid out without distortion, where one vertex has all but
// come down on another; `at_seam`: one that has copies.
Crowded crowded(bool at_seam, double left = 1e-6) {
  const ExecutionContext context;
  Crowded c;
  c.map = test::cut_map_of(test::unfold(test::polycubes()[1], 12, 3));
  c.constraints = eliminate_seams(static_cast<Index>(c.map.surface.vertices.rows()),
                                  c.map.surface.faces, c.map.seams, context);
  c.rest = build_rest_shapes(c.map.surface, context);
  std::vector<int> copies(c.constraints.position.size(), 0);
  const auto node_of = [&](VertexId v) {
    Index found = kInvalid;
    for (Index t = c.constraints.begin[static_cast<std::size_t>(v)];
         t < c.constraints.begin[static_cast<std::size_t>(v) + 1]; ++t) {
      const Index node = c.constraints.terms[static_cast<std::size_t>(t)].node;
      if (node < c.constraints.position_count()) found = node;
    }
    return found;
  };
  for (VertexId v = 0; v < static_cast<VertexId>(c.map.uv.rows()); ++v) {
    if (node_of(v) != kInvalid) ++copies[static_cast<std::size_t>(node_of(v))];
  }
  const Triangles& faces = c.map.surface.faces;
  for (CornerId corner = 0; corner < static_cast<CornerId>(faces.size()); ++corner) {
    const VertexId v = faces(corner / 3, corner % 3);
    const Index node = node_of(v);
    if (node == kInvalid || c.constraints.position[static_cast<std::size_t>(node)] != v) continue;
    if ((copies[static_cast<std::size_t>(node)] > 1) != at_seam) continue;
    const VertexId w = faces(corner / 3, (corner + 1) % 3);
    Points2 nodes = nodes_of(c.constraints, faces, c.map.seams, c.map.uv);
    nodes.row(node) += (1 - left) * (c.map.uv.row(w) - c.map.uv.row(v));
    const Points2 uv = map_of(c.constraints, nodes);
    if (!is_flip_free(faces, uv, context)) continue;
    c.map.uv = uv;
    c.moved = v;
    break;
  }
  return c;
}

double worst(const Crowded& c, const Points2& uv) {
  const ExecutionContext context;
  return sum_energy(c.map.surface.faces, c.rest.triangles, uv, context).worst_at_best_scale();
}

TEST(Relief, OpensACrowdedTriangleAndLeavesWhatIsFarFromItBitForBit) {
  for (const bool at_seam : {false, true}) {
    const Crowded c = crowded(at_seam);
    ASSERT_NE(c.moved, kInvalid) << at_seam;
    ASSERT_GT(worst(c, c.map.uv), 1e3);
    ExecutionContext context;
    Points2 uv = c.map.uv;
    const auto bad = relieve(c.constraints, c.map.surface.faces, c.rest, {}, uv, context);
    ASSERT_TRUE(bad.has_value());
    EXPECT_GT(*bad, 0);
    EXPECT_LT(worst(c, uv), 46.0);
    EXPECT_TRUE(is_flip_free(c.map.surface.faces, uv, context));
    Index same = 0;
    for (Eigen::Index v = 0; v < uv.rows(); ++v) same += uv.row(v) == c.map.uv.row(v) ? 1 : 0;
    EXPECT_GT(same, uv.rows() / 2);
    // Seams match as they did.
    const Points2 nearest =
        map_of(c.constraints, nodes_of(c.constraints, c.map.surface.faces, c.map.seams, uv));
    EXPECT_LT((nearest - uv).rowwise().norm().maxCoeff(), 1e-11);
  }
}

TEST(Relief, DoesNothingToAMapWithoutBadTriangles) {
  const CutMap map = test::cut_map_of(test::unfold(test::polycubes()[1], 3, 3));
  ExecutionContext context;
  const SeamConstraints constraints = eliminate_seams(
      static_cast<Index>(map.surface.vertices.rows()), map.surface.faces, map.seams, context);
  Points2 uv = map.uv;
  const auto bad = relieve(constraints, map.surface.faces, build_rest_shapes(map.surface, context),
                           {}, uv, context);
  ASSERT_TRUE(bad.has_value());
  EXPECT_EQ(*bad, 0);
  EXPECT_TRUE(uv == map.uv);
}

TEST(Relief, ReachesTheVerticesThatAreAskedFor) {
  const Crowded c = crowded(false, 0.5);
  ASSERT_NE(c.moved, kInvalid);
  ExecutionContext context;
  std::vector<char> near(static_cast<std::size_t>(c.map.uv.rows()), 0);
  near[static_cast<std::size_t>(c.moved)] = 1;
  Points2 uv = c.map.uv;
  ASSERT_TRUE(relieve(c.constraints, c.map.surface.faces, c.rest, near, uv, context).has_value());
  EXPECT_NE(uv.row(c.moved), c.map.uv.row(c.moved));
  EXPECT_LT(worst(c, uv), worst(c, c.map.uv));
}

TEST(Relief, LeavesAMapAloneThatIsBadAllOver) {
  Crowded c = crowded(false);
  ExecutionContext context;
  const std::vector<char> everywhere(static_cast<std::size_t>(c.map.uv.rows()), 1);
  Points2 uv = c.map.uv;
  EXPECT_FALSE(
      relieve(c.constraints, c.map.surface.faces, c.rest, everywhere, uv, context).has_value());
  EXPECT_TRUE(uv == c.map.uv);
}

}  // namespace
}  // namespace flipfree::distortion::relief_test
