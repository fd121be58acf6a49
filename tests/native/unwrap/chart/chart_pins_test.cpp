#include "flipfree/unwrap/chart/chart.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/base/error.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::chart_pins_test {
namespace {

// A grid that a seam along its middle column parts.
struct Case {
  mesh::Surface surface = test::grid(4, 2);
  mesh::Adjacency adjacency = test::adjacency_of(surface);
  Islands islands;
  Case() {
    IndexPairs seam(2, 2);
    seam << 2, 7, 7, 12;
    ExecutionContext context;
    islands = make_islands(surface, adjacency, mesh::flag_edges(surface.faces, adjacency, seam), {},
                           false, context);
  }
  std::vector<CornerId> corners_of(VertexId v) const {
    std::vector<CornerId> corners;
    for (CornerId c = 0; c < surface.faces.size(); ++c) {
      if (surface.faces(c / 3, c % 3) == v) corners.push_back(c);
    }
    return corners;
  }
};

TEST(ChartPins, every_pin_lands_at_its_vertex_of_its_chart) {
  Case c;
  ASSERT_EQ(c.islands.charts.size(), 2U);
  std::vector<certify::CornerPin> pins;
  for (CornerId corner = 0; corner < c.surface.faces.size(); ++corner) {
    const VertexId v = c.surface.faces(corner / 3, corner % 3);
    pins.push_back({corner, Vector2(v, corner / 3 < 0 ? 1 : 2)});
  }
  const ChartPins by_chart = pins_by_chart(c.islands, pins);
  ASSERT_EQ(by_chart.of_chart.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const mesh::Chart& chart = c.islands.charts[i];
    EXPECT_EQ(by_chart.of_chart[i].size(), chart.vertices.size()) << "each once";
    for (const auto& [local, uv] : by_chart.of_chart[i]) {
      const VertexId cut = chart.vertices[static_cast<std::size_t>(local)];
      EXPECT_EQ(uv.x(), c.islands.mesh.vertex_origin[static_cast<std::size_t>(cut)]);
    }
  }
}

TEST(ChartPins, a_vertex_on_a_seam_may_have_a_place_in_each_chart_but_not_two_in_one) {
  Case c;
  const std::vector<CornerId> corners = c.corners_of(7);
  std::vector<certify::CornerPin> pins;
  const auto chart_of = [&](CornerId corner) {
    for (std::size_t i = 0; i < 2; ++i) {
      const auto& faces = c.islands.charts[i].faces;
      if (std::find(faces.begin(), faces.end(), corner / 3) != faces.end()) return i;
    }
    return std::size_t{9};
  };
  for (const CornerId corner : corners)
    pins.push_back({corner, Vector2(static_cast<double>(chart_of(corner)), 0.5)});
  const ChartPins both = pins_by_chart(c.islands, pins);
  EXPECT_EQ(both.of_chart[0].size(), 1U);
  EXPECT_EQ(both.of_chart[1].size(), 1U);
  pins.front().uv.y() = 0.75;
  try {
    pins_by_chart(c.islands, pins);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kBadPins);
    EXPECT_EQ(e.error().elements, std::vector<Index>{7});
  }
}

TEST(ChartPins, corners_and_places_that_do_not_exist_are_refused) {
  const Case c;
  const double huge = 1e39, nan = std::numeric_limits<double>::quiet_NaN();
  for (const certify::CornerPin& pin :
       {certify::CornerPin{-1, Vector2(0, 0)}, certify::CornerPin{48, Vector2(0, 0)},
        certify::CornerPin{3, Vector2(huge, 0)}, certify::CornerPin{3, Vector2(0, nan)}}) {
    try {
      pins_by_chart(c.islands, {pin});
      FAIL();
    } catch (const InvalidInput& e) {
      EXPECT_EQ(e.error().code, ErrorCode::kBadPins);
      const bool exists = pin.corner == 3;
      EXPECT_EQ(e.error().elements, exists ? std::vector<Index>{3} : std::vector<Index>{});
    }
  }
}

TEST(ChartPins, without_pins_there_is_an_empty_list_for_every_chart_and_no_flag) {
  const Case c;
  EXPECT_EQ(pins_by_chart(c.islands, {}).of_chart.size(), 2U);
  EXPECT_TRUE(pinned_vertices(c.surface, {}).empty());
  const std::vector<char> pinned =
      pinned_vertices(c.surface, {{c.corners_of(7)[0], Vector2(0, 0)}, {-5, Vector2(0, 0)}});
  EXPECT_EQ(std::count(pinned.begin(), pinned.end(), 1), 1);
  EXPECT_EQ(pinned[7], 1);
}

// A closed surface all of whose vertices are pinned: an added cut doubles some.
TEST(ChartPins, added_cuts_through_pins_are_refused) {
  const mesh::Surface sphere = test::sphere(6, 4);
  ExecutionContext context;
  const Islands islands = make_islands(
      sphere, test::adjacency_of(sphere),
      mesh::EdgeFlags(static_cast<std::size_t>(sphere.faces.size()), 0), {}, false, context);
  std::vector<certify::CornerPin> pins;
  for (CornerId corner = 0; corner < sphere.faces.size(); ++corner)
    pins.push_back({corner, Vector2(sphere.faces(corner / 3, corner % 3), 0.0)});
  EXPECT_THROW(pins_by_chart(islands, pins), NotConverged);
}

}  // namespace
}  // namespace flipfree::unwrap::chart_pins_test
