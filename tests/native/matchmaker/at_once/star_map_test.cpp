#include "flipfree/matchmaker/at_once/star_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "flipfree/numeric/predicates.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::star_map_test {
namespace {

// A square grid as a disk around the origin.
mesh::RefinedMap disk(const mesh::Surface& surface) {
  mesh::RefinedMap map = test::identity_map(surface);
  map.uv = 1.4 * (map.uv.array() - 0.5).matrix();
  return map;
}

// Random inner vertices to random points.
Constraints random_pins(const mesh::RefinedMap& map, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  const auto number = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::set<VertexId> chosen;
  while (chosen.size() < count) {
    const auto v = static_cast<VertexId>(number() * map.surface.mesh.vertex_count());
    if (!map.surface.mesh.is_boundary_vertex(v)) chosen.insert(v);
  }
  Constraints constraints;
  for (const VertexId v : chosen) {
    const double x = number();
    constraints.pins.push_back({v, {x, number()}});
  }
  return constraints;
}

std::vector<Vector2> places(const mesh::RefinedMap& map, const Constraints& constraints) {
  std::vector<Vector2> result;
  for (const PinnedVertex& p : constraints.pins)
    result.emplace_back(map.uv.row(p.vertex).transpose());
  return result;
}

void expect_star(const PlaneMap& star, const mesh::RefinedMap& map,
                 const Constraints& constraints) {
  const ExecutionContext context;
  EXPECT_TRUE(distortion::find_flips(star.faces, star.before, context).empty());
  EXPECT_TRUE(distortion::find_flips(star.faces, star.after, context).empty());
  std::size_t boundary = 0;
  std::size_t pins = 0;
  for (std::size_t v = 0; v < star.vertex.size(); ++v) {
    const VertexId w = star.vertex[v];
    if (w == kInvalid) continue;
    const auto row = static_cast<Eigen::Index>(v);
    EXPECT_EQ(star.before.row(row), map.uv.row(w));
    boundary += map.surface.mesh.is_boundary_vertex(w) ? 1 : 0;
    for (const PinnedVertex& p : constraints.pins) {
      if (p.vertex != w) continue;
      ++pins;
      EXPECT_EQ(Vector2(star.after.row(row).transpose()), p.uv);
    }
  }
  EXPECT_EQ(boundary, mesh::compacted_map(map).surface.boundary.size());
  EXPECT_EQ(pins, constraints.pins.size());
}

TEST(StarMap, IsPositiveOnBothSidesWithThePinsAtTheirTargetsFromWhereverTheyAreSeen) {
  const mesh::Surface surface = test::grid(16, 16);
  const mesh::RefinedMap map = disk(surface);
  const ExecutionContext context;
  for (const std::size_t count : {3U, 8U, 60U}) {
    const Constraints constraints = random_pins(map, count, 5);
    const std::vector<StarView> views = star_views(places(map, constraints));
    ASSERT_GT(views.size(), 20U);
    std::size_t stars = 0;
    for (const StarView& view : views) {
      mesh::RefinedMap split = map;
      const std::optional<PlaneMap> star = make_star(split, constraints, view, context);
      if (!star) continue;
      ++stars;
      expect_star(*star, split, constraints);
    }
    // Some centres may lie too close to a pin.
    EXPECT_GT(2 * stars, views.size());
  }
}

TEST(StarMap, SplitsBoundaryEdgesWhereTheBoundaryIsTooShort) {
  const mesh::Surface surface = test::grid(6, 6);
  const mesh::RefinedMap map = disk(surface);
  const Constraints constraints = random_pins(map, 20, 3);
  const std::vector<StarView> views = star_views(places(map, constraints));
  mesh::RefinedMap split = map;
  const ExecutionContext context;
  const auto star = make_star(split, constraints, views[views.size() / 2], context);
  ASSERT_TRUE(star);
  expect_star(*star, split, constraints);
  // Three for every arm, where 24 are.
  EXPECT_GE(split.surface.mesh.vertex_count(), map.surface.mesh.vertex_count() + 3 * 20 + 1 - 24);
  test::expect_valid(split);
}

TEST(StarMap, PinsOnTheBoundaryAreTipsOfArmsThemselves) {
  const mesh::Surface surface = test::grid(10, 10);
  const mesh::RefinedMap map = disk(surface);
  Constraints constraints = random_pins(map, 4, 11);
  for (const std::size_t i : {3U, 17U, 30U})
    constraints.pins.push_back(
        {map.surface.boundary[i], {0.1 * static_cast<double>(i), -0.05 * static_cast<double>(i)}});
  const ExecutionContext context;
  std::size_t stars = 0;
  for (const StarView& view : star_views(places(map, constraints))) {
    mesh::RefinedMap split = map;
    const auto star = make_star(split, constraints, view, context);
    if (!star) continue;
    ++stars;
    expect_star(*star, split, constraints);
  }
  EXPECT_GT(stars, 20U);
}

TEST(StarMap, LeavesOutViewsInWhichTwoPinsLieInOneDirection) {
  const std::vector<Vector2> pins = {{0.5, 0.1}, {-0.3, 0.7}, {0.2, -0.6}};
  const std::size_t all = star_views(pins).size();
  const Vector2 centre = star_views(pins).front().centre;
  std::vector<Vector2> behind = pins;
  behind.push_back(centre + 2 * (pins[0] - centre));
  for (const StarView& view : star_views(behind)) EXPECT_NE(view.centre, centre);
  EXPECT_LT(star_views(behind).size(), all);
}

}  // namespace
}  // namespace flipfree::matchmaker::star_map_test
