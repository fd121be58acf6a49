#include "flipfree/unwrap/seams/auto_islands.h"

#include <gtest/gtest.h>

#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/unwrap.h"
#include "support/shapes.h"

namespace flipfree::unwrap::seams_test {
namespace {

UnwrapOptions automatic() {
  UnwrapOptions options;
  options.seams.find = true;
  return options;
}

TEST(FindSeams, are_all_the_seams_that_an_unwrap_needs) {
  for (const mesh::Surface& surface :
       {test::sphere(16, 10), test::torus(20, 10), test::perforated_plate(2, 2)}) {
    ExecutionContext context;
    UnwrapOptions given;
    given.cuts = find_seams(surface, automatic(), context);
    const certify::Parametrization map = unwrap(surface, given, context);
    EXPECT_EQ(std::get<std::int64_t>(map.stats.at("added_cuts")), 0);
    EXPECT_LE(map.certificate.energy, 1.025);
    EXPECT_EQ(map.cut_edges, given.cuts);
  }
}

TEST(FindSeams, are_edges_of_the_mesh_where_that_had_to_be_separated) {
  // Two balls that share a vertex, one turned inside out.
  const mesh::Surface ball = test::sphere(8, 6);
  const auto count = static_cast<Index>(ball.vertices.rows());
  mesh::Surface pair;
  pair.vertices.resize(2 * count - 1, 3);
  pair.vertices << ball.vertices, -ball.vertices.bottomRows(count - 1);
  pair.vertices.bottomRows(count - 1).rowwise() += 2.0 * ball.vertices.row(0);
  pair.faces.resize(2 * ball.faces.rows(), 3);
  for (FaceId f = 0; f < ball.faces.rows(); ++f) {
    pair.faces.row(f) = ball.faces.row(f);
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = ball.faces(f, k);
      pair.faces(ball.faces.rows() + f, k) = v == 0 ? 0 : count + v - 1;
    }
  }
  ExecutionContext context;
  const IndexPairs seams = find_seams(pair, automatic(), context);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(ball.vertices.rows()), ball.faces);
  ASSERT_GT(seams.rows(), 0);
  for (Eigen::Index i = 0; i < seams.rows(); ++i) {
    IndexPairs edge(1, 2);
    for (Index k = 0; k < 2; ++k)
      edge(0, k) = seams(i, k) < count ? seams(i, k) : seams(i, k) - count + 1;
    EXPECT_NO_THROW(mesh::flag_edges(ball.faces, adjacency, edge));
  }
}

}  // namespace
}  // namespace flipfree::unwrap::seams_test
