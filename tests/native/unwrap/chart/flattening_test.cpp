#include "flipfree/unwrap/chart/chart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::flattening_test {
namespace {

struct Case {
  mesh::Surface surface;
  mesh::Adjacency adjacency;
  Islands islands;
  UnwrapOptions options;
  ExecutionContext context;
  Stats stats;
  std::vector<certify::CornerPin> pins;
  Case(mesh::Surface given, const IndexPairs& seam)
      : surface(std::move(given)), adjacency(test::adjacency_of(surface)) {
    islands = make_islands(surface, adjacency, mesh::flag_edges(surface.faces, adjacency, seam), {},
                           false, context);
  }
  std::vector<Points2> flatten() {
    return flatten_islands(islands, surface, adjacency, {}, pins_by_chart(islands, pins), options,
                           context, stats);
  }
};
Case parted_grid() {
  mesh::Surface surface = test::bumpy_grid(8, 4, 0.1, 2.0);
  IndexPairs seam(4, 2);
  for (Index j = 0; j < 4; ++j) seam.row(j) << 9 * j + 5, 9 * (j + 1) + 5;
  return {surface, seam};
}

TEST(Flattening, every_chart_is_flip_free_in_its_own_unit_and_centred) {
  for (const double unit : {1e-120, 1.0, 1e100}) {
    Case c = parted_grid();
    Case scaled({c.surface.vertices * unit, c.surface.faces}, IndexPairs(0, 2));
    scaled.islands = c.islands;
    for (mesh::Chart& chart : scaled.islands.charts) chart.surface.vertices *= unit;
    const std::vector<Points2> flat = scaled.flatten();
    ASSERT_EQ(flat.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      const mesh::Chart& chart = scaled.islands.charts[i];
      ASSERT_EQ(flat[i].rows(), chart.surface.vertices.rows());
      EXPECT_TRUE(distortion::is_flip_free(chart.surface.faces, flat[i], c.context));
      const auto box = (flat[i].colwise().maxCoeff() + flat[i].colwise().minCoeff()).eval();
      EXPECT_LT(box.norm(), 1e-6 * unit);
      // Edges keep about their lengths.
      for (Eigen::Index f = 0; f < chart.surface.faces.rows(); ++f) {
        const Index a = chart.surface.faces(f, 0), b = chart.surface.faces(f, 1);
        const double length =
            (chart.surface.vertices.row(a) - chart.surface.vertices.row(b)).norm();
        EXPECT_NEAR((flat[i].row(a) - flat[i].row(b)).norm() / length, 1.0, 0.5);
      }
    }
  }
}

TEST(Flattening, threads_do_not_change_a_bit) {
  std::vector<std::vector<Points2>> results;
  for (const int threads : {1, 3}) {
    Case c = parted_grid();
    c.context.threads = threads;
    results.push_back(c.flatten());
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(Flattening, pins_are_met_bit_for_bit) {
  Case c = parted_grid();
  c.pins = {{0, Vector2(0.25, -3.0)}};
  const std::vector<Points2> flat = c.flatten();
  const ChartPins pins = pins_by_chart(c.islands, c.pins);
  int met = 0;
  for (std::size_t i = 0; i < flat.size(); ++i) {
    for (const auto& [v, uv] : pins.of_chart[i]) {
      ++met;
      EXPECT_EQ(Vector2(flat[i].row(v)), uv);
    }
  }
  EXPECT_EQ(met, 1);
}

TEST(Flattening, errors_speak_of_the_users_mesh) {
  const Case c = parted_grid();
  const mesh::Chart& chart = c.islands.charts[1];
  const auto original = [&](VertexId v) {
    return c.islands.mesh
        .vertex_origin[static_cast<std::size_t>(chart.vertices[static_cast<std::size_t>(v)])];
  };
  const Error vertex = in_terms_of_input(
      {ErrorCode::kBadPins, "Wrong.", ElementKind::kVertex, {3, 1}}, c.islands, 1);
  EXPECT_EQ(vertex.elements, (std::vector<Index>{original(3), original(1)}));
  EXPECT_EQ(vertex.kind, ElementKind::kVertex);
  EXPECT_EQ(vertex.code, ErrorCode::kBadPins);
  EXPECT_NE(vertex.message.find("first at vertex " + std::to_string(original(3))),
            std::string::npos);
  EXPECT_NE(vertex.message.find("Wrong."), std::string::npos);
  const Error face =
      in_terms_of_input({ErrorCode::kBadPins, "Wrong.", ElementKind::kFace, {2}}, c.islands, 1);
  EXPECT_EQ(face.elements, std::vector<Index>{chart.faces[2]});
  // Elements of nobody's mesh, or none: the whole chart.
  for (const std::vector<Index>& elements : {std::vector<Index>{99999}, std::vector<Index>{}}) {
    const Error whole = in_terms_of_input(
        {ErrorCode::kBadPins, "Wrong.", ElementKind::kVertex, elements}, c.islands, 1);
    EXPECT_EQ(whole.kind, ElementKind::kFace);
    EXPECT_EQ(whole.elements, chart.faces);
  }
}

}  // namespace
}  // namespace flipfree::unwrap::flattening_test
