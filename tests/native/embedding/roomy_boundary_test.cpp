#include "flipfree/embedding/roomy_boundary.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/embedding/chords.h"
#include "flipfree/embedding/embed_surface.h"
#include "flipfree/mesh/topology.h"
#include "support/shapes.h"

namespace flipfree::embedding::roomy_boundary_test {
namespace {

struct Rim {
  mesh::Surface surface;
  Index vertices;
  std::vector<VertexId> loop;
  std::vector<double> lengths;

  explicit Rim(mesh::Surface given)
      : surface(std::move(given)), vertices(static_cast<Index>(surface.vertices.rows())) {
    const mesh::Adjacency adjacency = mesh::build_adjacency(vertices, surface.faces);
    loop = mesh::boundary_loops(surface.faces, adjacency).front();
    lengths.assign(loop.size(), 1.0);
  }
  Points2 place(BoundaryShape shape = BoundaryShape::kCircle) const {
    return place_with_room(shape, lengths, surface.faces, vertices, loop, {});
  }
  std::size_t without_room(const Points2& positions) const {
    return chords_to_split(surface.faces, vertices, loop, positions, true).size();
  }
};

TEST(RoomyBoundary, strips_of_any_length_have_room_for_all_their_edges) {
  for (const Index length : {1000, 30000, 100000, 400000}) {
    const Rim strip(test::grid(length, 1));
    const Points2 circle = strip.place();
    EXPECT_EQ(strip.without_room(circle), 0U) << length;
    EXPECT_TRUE(is_strictly_convex(circle)) << length;
    EXPECT_NEAR(circle.rowwise().norm().minCoeff(), 1.0, 0.05) << length;
  }
}

TEST(RoomyBoundary, where_there_is_room_nothing_changes) {
  const Rim sheet(test::grid(20, 20));
  EXPECT_EQ(sheet.place(), place_boundary(BoundaryShape::kCircle, sheet.lengths).positions);
}

TEST(RoomyBoundary, other_shapes_are_as_they_were) {
  const Rim strip(test::grid(30000, 1));
  for (const BoundaryShape shape : {BoundaryShape::kSquare, BoundaryShape::kTriangle})
    EXPECT_EQ(strip.place(shape), place_boundary(shape, strip.lengths).positions);
}

TEST(RoomyBoundary, a_long_strip_is_embedded_without_new_vertices) {
  ExecutionContext context;
  const certify::Parametrization map = embed_surface(test::grid(100000, 1), {}, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(std::get<std::int64_t>(map.stats.at("added_vertices")), 0);
}

// Evenly spaced points that one cannot tell from a line as stored, and the cure that is named.
TEST(RoomyBoundary, a_polygon_without_room_for_a_strip_is_refused_with_a_cure_that_works) {
  const Rim strip(test::grid(100000, 1));
  EmbedSurfaceOptions options;
  options.loop = strip.loop;
  options.polygon = spread_on_circle(strip.lengths);
  ExecutionContext context;
  try {
    embed_surface(strip.surface, options, context);
    FAIL() << "a map was found";
  } catch (const NotConverged& e) {
    EXPECT_NE(e.error().message.find("Take the circle as the boundary"), std::string::npos)
        << e.error().message;
    EXPECT_EQ(e.error().kind, ElementKind::kEdge);
  }
  EXPECT_TRUE(embed_surface(strip.surface, {}, context).certificate.ok);
}

}  // namespace
}  // namespace flipfree::embedding::roomy_boundary_test
