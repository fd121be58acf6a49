#include "flipfree/unwrap/seams/sheet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "flipfree/unwrap/seams/costs.h"
#include "support/shapes.h"
#include "support/thread_seconds.h"

namespace flipfree::unwrap::mirror_test {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// A sheet whose columns bend alike on both sides; diagonals cost infinitely much.
struct Sample {
  mesh::Surface surface;
  std::vector<double> cost;
};

Sample bent_sheet(Index columns) {
  Sample sample{test::grid(columns, 5), {}};
  Points3& places = sample.surface.vertices;
  places.col(0).array() -= 0.5 * places.col(0).maxCoeff();
  for (Eigen::Index v = 0; v < places.rows(); ++v)
    places(v, 2) = places(v, 0) * places(v, 0) + 0.3 * places(v, 1) * places(v, 1) * places(v, 1);
  sample.cost = edge_costs(sample.surface, {}, {});
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(sample.cost.size()); ++h) {
    const Vector3 along = places.row(mesh::source(sample.surface.faces, h)) -
                          places.row(mesh::target(sample.surface.faces, h));
    if (std::abs(along.x()) > 1e-9 && std::abs(along.y()) > 1e-9)
      sample.cost[static_cast<std::size_t>(h)] = kNever;
  }
  return sample;
}

TEST(Mirror, maps_vertices_and_edges_to_their_images) {
  for (const Index columns : {6, 7}) {  // with vertices on the plane, and without
    const Sample sample = bent_sheet(columns);
    const Mirror mirror = find_mirror(sample.surface, sample.cost);
    ASSERT_FALSE(mirror.empty());
    for (VertexId v = 0; v < sample.surface.vertices.rows(); ++v) {
      const Vector3 p = sample.surface.vertices.row(v);
      const Vector3 q = sample.surface.vertices.row(mirror.image[static_cast<std::size_t>(v)]);
      EXPECT_NEAR((q - Vector3(-p.x(), p.y(), p.z())).norm(), 0.0, 1e-9);
    }
    const Triangles& faces = sample.surface.faces;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(sample.cost.size()); ++h) {
      const HalfedgeId image = mirror.edge[static_cast<std::size_t>(h)];
      if (sample.cost[static_cast<std::size_t>(h)] == kNever) continue;
      ASSERT_NE(image, kInvalid);
      const auto of = [&](VertexId v) { return mirror.image[static_cast<std::size_t>(v)]; };
      EXPECT_EQ(std::minmax({of(mesh::source(faces, h)), of(mesh::target(faces, h))}),
                std::minmax({mesh::source(faces, image), mesh::target(faces, image)}));
    }
  }
}

TEST(Mirror, is_found_wherever_the_chart_lies) {
  Sample sample = bent_sheet(8);
  const double c = std::cos(0.7);
  const double s = std::sin(0.7);
  Eigen::Matrix3d turn;
  turn << c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0;
  Eigen::Matrix3d tilt;
  tilt << 1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c;
  sample.surface.vertices = 40.0 * sample.surface.vertices * (tilt * turn).transpose();
  sample.surface.vertices.rowwise() += Eigen::RowVector3d(3.0, -20.0, 7.0);
  EXPECT_FALSE(find_mirror(sample.surface, sample.cost).empty());
}

// Whoever looks for an edge at its hub walks past all spokes, for each of them.
TEST(Mirror, of_spokes_takes_little_more_than_of_a_sheet) {
  const auto seconds = [](const Sample& sample) {
    const double begin = test::thread_seconds();
    const Mirror mirror = find_mirror(sample.surface, sample.cost);
    const double end = test::thread_seconds();
    EXPECT_FALSE(mirror.empty());
    return end - begin;
  };
  Sample spokes{test::sphere(12000, 2), {}};
  spokes.cost.assign(at(spokes.surface.faces.size()), 1.0);
  EXPECT_LT(seconds(spokes), 10.0 * seconds(bent_sheet(2400)));
}

TEST(Mirror, is_none_where_a_place_an_edge_or_a_cost_differs) {
  const Sample sample = bent_sheet(6);
  Sample moved = sample;
  moved.surface.vertices(9, 2) += 0.01;
  EXPECT_TRUE(find_mirror(moved.surface, moved.cost).empty());
  Sample painted = sample;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(painted.cost.size()); ++h) {
    const double x = sample.surface.vertices(mesh::source(sample.surface.faces, h), 0) +
                     sample.surface.vertices(mesh::target(sample.surface.faces, h), 0);
    if (x > 0.0) painted.cost[static_cast<std::size_t>(h)] *= 10.0;
  }
  EXPECT_TRUE(find_mirror(painted.surface, painted.cost).empty());
  // All diagonals run the same way: as edges that may be seams they have no image.
  const std::vector<double> all = edge_costs(sample.surface, {}, {});
  EXPECT_TRUE(find_mirror(sample.surface, all).empty());
}

TEST(Mirror, costs_are_the_same_on_both_sides_and_less_on_the_plane) {
  const Sample sample = bent_sheet(6);
  const Mirror mirror = find_mirror(sample.surface, sample.cost);
  const std::vector<double> cost = mirrored_costs(sample.surface.faces, mirror, sample.cost);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const auto i = static_cast<std::size_t>(h);
    if (mirror.edge[i] == kInvalid) continue;
    EXPECT_DOUBLE_EQ(cost[i], cost[static_cast<std::size_t>(mirror.edge[i])]);
    const bool on_plane =
        mirror.image[static_cast<std::size_t>(mesh::source(sample.surface.faces, h))] ==
            mesh::source(sample.surface.faces, h) &&
        mirror.image[static_cast<std::size_t>(mesh::target(sample.surface.faces, h))] ==
            mesh::target(sample.surface.faces, h);
    if (on_plane) {
      EXPECT_LT(cost[i], 0.9 * sample.cost[i]);
    }
  }
}

}  // namespace
}  // namespace flipfree::unwrap::mirror_test
