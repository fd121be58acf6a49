#include "flipfree/unwrap/repair/given_map.h"

#include <gtest/gtest.h>

#include <limits>

#include "flipfree/base/error.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::given_map_test {
namespace {

struct Given {
  mesh::Surface surface = test::grid(6, 6);
  mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  Points2 uv = test::flat(surface);

  GivenMap read(const std::vector<certify::CornerPin>& pins = {},
                const mesh::EdgeFlags& seams = {}) const {
    return read_map(surface, adjacency, uv, seams, pins);
  }
  std::vector<CornerId> corners(VertexId v) const {
    std::vector<CornerId> found;
    for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
      if (surface.faces.data()[c] == v) found.push_back(c);
    }
    return found;
  }
};

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

TEST(GivenMap, a_corner_without_a_value_takes_its_neighbours) {
  Given given;
  const Points2 sound = given.uv;
  const CornerId c = given.corners(24)[2];
  given.uv(c, 1) = kNothing;
  given.uv(0, 0) = 1e300;
  const GivenMap map = given.read();
  EXPECT_EQ(map.uv, sound);
  EXPECT_EQ(map.charts.size(), 1U);
  EXPECT_EQ(std::count(map.unknown[0].begin(), map.unknown[0].end(), 1), 0);
}

TEST(GivenMap, a_face_that_lost_both_ends_of_an_edge_is_not_joined_across_it) {
  Given given;
  // All faces are apart: nothing says that the map goes on across the edge whose ends it lost.
  for (FaceId g = 0; g < given.surface.faces.rows(); ++g)
    given.uv.middleRows<3>(3 * g).col(0).array() += 5.0 * g;
  const FaceId f = 30;
  given.uv.row(3 * f).setConstant(kNothing);
  given.uv.row(3 * f + 1).setConstant(kNothing);
  const GivenMap map = given.read();
  EXPECT_EQ(map.charts.size(), static_cast<std::size_t>(given.surface.faces.rows()));
  for (std::size_t c = 0; c < map.charts.size(); ++c) {
    const bool own = map.charts[c].faces.front() == f;
    EXPECT_EQ(std::count(map.unknown[c].begin(), map.unknown[c].end(), 1), own ? 2 : 0);
  }
}

TEST(GivenMap, lost_corners_of_a_face_within_a_chart_are_its_neighbours) {
  Given given;
  const Points2 sound = given.uv;
  for (const Index k : {0, 1}) given.uv.row(3 * 30 + k).setConstant(kNothing);
  const GivenMap map = given.read();
  EXPECT_EQ(map.uv, sound);
  EXPECT_EQ(map.charts.size(), 1U);
}

// Around a vertex there is no first corner.
TEST(GivenMap, a_value_comes_from_either_side_wherever_the_ring_begins) {
  const Given sound;
  const std::vector<CornerId> ring = sound.corners(24);
  for (const CornerId lost : ring) {
    for (const bool next : {false, true}) {
      Given given;
      given.uv.row(lost).setConstant(kNothing);
      // One of the two edges beside it does not tell whether the map goes on: its other end is
      // lost.
      given.uv.row(next ? next_corner(lost) : previous_corner(lost)).setConstant(kNothing);
      const GivenMap map = given.read();
      EXPECT_EQ(map.uv, sound.uv) << lost;
      EXPECT_EQ(map.rejoined, 0) << lost;
    }
  }
}

TEST(GivenMap, a_vertex_without_any_gets_the_mean_of_its_neighbours_as_a_guess) {
  Given given;
  for (const CornerId c : given.corners(24)) given.uv.row(c).setConstant(kNothing);
  const GivenMap map = given.read();
  EXPECT_EQ(std::count(map.unknown[0].begin(), map.unknown[0].end(), 1), 1);
  EXPECT_NEAR((map.uv.row(given.corners(24)[0]) - Eigen::RowVector2d(0.5, 0.5)).norm(), 0.0, 1e-9);
}

TEST(GivenMap, a_lost_vertex_on_a_cut_has_a_place_on_either_side) {
  Given given;
  for (FaceId f = 0; f < given.surface.faces.rows(); ++f) {
    if (given.uv.middleRows<3>(3 * f).col(0).mean() > 0.5)
      given.uv.middleRows<3>(3 * f).col(0).array() += 5.0;
  }
  for (const CornerId c : given.corners(24)) given.uv.row(c).setConstant(kNothing);
  const GivenMap map = given.read();
  EXPECT_EQ(map.charts.size(), 2U);
  for (const CornerId c : given.corners(24)) EXPECT_LT(std::abs(map.uv(c, 0) - 3.0), 3.0);
  double least = 9.0;
  double most = 0.0;
  for (const CornerId c : given.corners(24)) {
    least = std::min(least, map.uv(c, 0));
    most = std::max(most, map.uv(c, 0));
  }
  EXPECT_LT(least, 1.0);
  EXPECT_GT(most, 5.0);
}

TEST(GivenMap, a_map_without_values_is_one_chart) {
  Given given;
  given.uv.setConstant(kNothing);
  const GivenMap map = given.read();
  EXPECT_EQ(map.charts.size(), 1U);
  EXPECT_TRUE(map.uv.isZero(0.0));
}

TEST(GivenMap, pins_move_all_corners_of_a_place) {
  const Given given;
  const GivenMap map = given.read({{given.corners(24)[1], Vector2(0.7, 0.7)}});
  ASSERT_EQ(map.pins[0].size(), 1U);
  EXPECT_EQ(map.places[0].row(map.pins[0][0].first), Eigen::RowVector2d(0.7, 0.7));
}

TEST(GivenMap, pins_that_nothing_can_meet_are_refused) {
  const Given given;
  const auto code = [&](const std::vector<certify::CornerPin>& pins) {
    try {
      given.read(pins);
    } catch (const InvalidInput& e) {
      return e.error().code;
    }
    return ErrorCode::kInternal;
  };
  const std::vector<CornerId> corners = given.corners(24);
  EXPECT_EQ(code({{corners[0], Vector2(0, 0)}, {corners[1], Vector2(1, 0)}}), ErrorCode::kBadPins);
  EXPECT_EQ(code({{-1, Vector2(0, 0)}}), ErrorCode::kBadPins);
  EXPECT_EQ(code({{100000, Vector2(0, 0)}}), ErrorCode::kBadPins);
  EXPECT_EQ(code({{0, Vector2(1e39, 0)}}), ErrorCode::kBadPins);
}

}  // namespace
}  // namespace flipfree::unwrap::given_map_test
