#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>

#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/islands/sheet.h"
#include "flipfree/unwrap/seams/costs.h"
#include "flipfree/unwrap/seams/nets.h"
#include "support/shapes.h"

namespace flipfree::unwrap::seams_test {
namespace {

double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::vector<double> exposure_of(const mesh::Surface& surface, int threads = 1) {
  ExecutionContext context;
  context.threads = threads;
  return exposure(surface, context);
}

TEST(Exposure, of_a_ball_is_one_everywhere) {
  for (const double seen : exposure_of(test::sphere(48, 32))) EXPECT_NEAR(seen, 1.0, 0.2);
}

TEST(Exposure, is_less_inside_a_tube) {
  mesh::Surface tube = test::tube(32, 24);  // closed at the far end: nobody looks in from there
  tube.vertices *= 0.25;
  const std::vector<double> open = exposure_of(tube);
  double rim = 0.0;
  double end = 0.0;
  for (std::size_t v = 0; v < open.size(); ++v) {
    const bool at_rim = v < 32;
    (at_rim ? rim : end) += open[v] / (at_rim ? 32.0 : static_cast<double>(open.size() - 32));
  }
  EXPECT_GT(rim, end);
}

// A wall close behind another hides its face, and both their outer sides are seen.
TEST(Exposure, is_less_between_two_walls) {
  mesh::Surface walls = test::grid(12, 12);
  const Eigen::Index count = walls.vertices.rows();
  const Eigen::Index faces = walls.faces.rows();
  // A third in the middle is hidden from both sides.
  walls.vertices.conservativeResize(3 * count, 3);
  Triangles all = walls.faces.triangles().replicate(3, 1);
  for (Index k = 1; k < 3; ++k) {
    walls.vertices.middleRows(k * count, count) = walls.vertices.topRows(count);
    walls.vertices.middleRows(k * count, count).col(2).array() += 0.02 * k;
    all.middleRows(k * faces, faces).array() += static_cast<int>(k * count);
  }
  walls.faces = std::move(all);
  const std::vector<double> seen = exposure_of(walls);
  const auto middle = static_cast<std::size_t>(6 * 13 + 6);
  EXPECT_LT(seen[middle + static_cast<std::size_t>(count)], 0.2 * seen[middle]);
}

TEST(Exposure, is_less_at_the_back_of_what_has_a_face) {
  mesh::Surface head = test::sphere(96, 64);
  for (Eigen::Index v = 0; v < head.vertices.rows(); ++v) {
    const Vector3 p = head.vertices.row(v);
    if (p.x() > 0.3)
      head.vertices.row(v) *= 1.0 + 0.06 * std::sin(16.0 * p.y()) * std::sin(16.0 * p.z());
  }
  const std::vector<double> seen = exposure_of(head);
  double front = 0.0;
  double back = 0.0;
  int counted[2] = {0, 0};
  for (Eigen::Index v = 0; v < head.vertices.rows(); ++v) {
    const double x = head.vertices(v, 0);
    if (std::abs(x) < 0.7) continue;
    (x > 0.0 ? front : back) += seen[static_cast<std::size_t>(v)];
    ++counted[x > 0.0 ? 0 : 1];
  }
  EXPECT_GT(front / counted[0], 1.3 * back / counted[1]);
}

TEST(Exposure, does_not_depend_on_the_unit_the_place_or_the_number_of_threads) {
  mesh::Surface head = test::bumpy_grid(24, 24, 0.5, 2.0);
  const std::vector<double> seen = exposure_of(head);
  EXPECT_EQ(exposure_of(head, 4), seen);
  head.vertices *= 0x1p-1000;
  EXPECT_EQ(exposure_of(head), seen);
}

// Spokes are needles across the whole picture: their boxes overlap, and are not walked.
TEST(Exposure, of_spokes_takes_little_more_than_of_a_ball) {
  const auto seconds = [](const mesh::Surface& surface) {
    ExecutionContext context;
    context.threads = 1;
    const double begin = thread_seconds();
    exposure(surface, context);
    return thread_seconds() - begin;
  };
  EXPECT_LT(seconds(test::sphere(10000, 2)), 12.0 * seconds(test::sphere(100, 100)));
}

TEST(Exposure, of_what_has_no_area_is_one) {
  mesh::Surface point = test::tetrahedron();
  point.vertices.setZero();
  EXPECT_EQ(exposure_of(point), std::vector<double>(4, 1.0));
}

// A 12 x 4 grid, vertex (column, row) = 13 row + column, with a field that is zero on its border.
struct Field {
  mesh::Surface surface = test::grid(12, 4);
  std::vector<double> u = std::vector<double>(65, 0.0);
  std::vector<double> area = std::vector<double>(65, 1.0);
  std::vector<char> reach = std::vector<char>(65, 1);

  std::vector<Hill> found() const {
    std::vector<Hill> hills = unwrap::hills(surface, u, area, reach);
    std::sort(hills.begin(), hills.end(),
              [](const Hill& a, const Hill& b) { return a.peak < b.peak; });
    return hills;
  }
};

TEST(Hills, the_lower_of_two_gains_what_stands_out_of_the_pass_and_the_higher_all) {
  Field field;
  for (const auto& [column, height] : {std::pair{3, 1.0}, {4, 3.0}, {5, 1.0}, {6, 2.0}, {7, 1.0}})
    field.u[static_cast<std::size_t>(2 * 13 + column)] = height;
  const std::vector<Hill> hills = field.found();
  ASSERT_EQ(hills.size(), 2U);
  EXPECT_EQ(hills[0].peak, 2 * 13 + 4);
  EXPECT_DOUBLE_EQ(hills[0].gain, 9.0 + 4.0 + 3.0);
  EXPECT_EQ(hills[1].peak, 2 * 13 + 6);
  EXPECT_DOUBLE_EQ(hills[1].gain, 1.0);
}

TEST(Hills, growth_and_shrinking_are_told_apart) {
  Field field;
  field.u[2 * 13 + 4] = 2.0;
  field.u[2 * 13 + 5] = -1.0;
  const std::vector<Hill> hills = field.found();
  ASSERT_EQ(hills.size(), 2U);
  EXPECT_DOUBLE_EQ(hills[0].gain, 4.0);
  EXPECT_DOUBLE_EQ(hills[1].gain, 1.0);
}

TEST(Hills, end_where_a_seam_may_end) {
  Field field;
  field.u[2 * 13 + 4] = 2.0;
  field.u[2 * 13 + 5] = 1.0;
  field.reach[2 * 13 + 4] = 0;
  ASSERT_EQ(field.found().size(), 1U);
  EXPECT_EQ(field.found()[0].peak, 2 * 13 + 5);
  field.reach[2 * 13 + 5] = 0;
  EXPECT_TRUE(field.found().empty());
}

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
    const double begin = thread_seconds();
    const Mirror mirror = find_mirror(sample.surface, sample.cost);
    const double end = thread_seconds();
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

mesh::EdgeFlags nets_of(const mesh::Surface& surface) {
  const std::vector<double> cost = edge_costs(surface, {}, {});
  return net_seams(surface, mesh::EdgeFlags(cost.size(), 0), cost, {}, ExecutionContext());
}

std::ptrdiff_t edges_of(const mesh::EdgeFlags& flags) {
  return std::count(flags.begin(), flags.end(), 1) / 2;
}

// Rings (radius, height) of `sectors` vertices between two poles.
mesh::Surface turned(Index sectors, const std::vector<Vector2>& rings, double low, double high) {
  mesh::Surface surface = test::sphere(sectors, static_cast<Index>(rings.size()) + 1);
  VertexId pole[2] = {0, 0};
  for (VertexId v = 0; v < surface.vertices.rows(); ++v) {
    if (surface.vertices(v, 2) < surface.vertices(pole[0], 2)) pole[0] = v;
    if (surface.vertices(v, 2) > surface.vertices(pole[1], 2)) pole[1] = v;
  }
  for (VertexId v = 0; v < surface.vertices.rows(); ++v) {
    const double angle = std::acos(std::clamp(-surface.vertices(v, 2), -1.0, 1.0));
    const auto count = static_cast<double>(rings.size() + 1);
    const auto ring = static_cast<std::size_t>(std::lround(angle / std::numbers::pi * count));
    if (v == pole[0] || v == pole[1]) {
      surface.vertices.row(v) << 0, 0, v == pole[0] ? low : high;
      continue;
    }
    const double radius = surface.vertices.row(v).head<2>().norm();
    surface.vertices.row(v).head<2>() *= rings[ring - 1].x() / radius;
    surface.vertices(v, 2) = rings[ring - 1].y();
  }
  return surface;
}

// Of all islands between flagged edges, the angle that inner vertices lack of a full turn, at most.
double most_curvature_inside(const mesh::Surface& surface, const mesh::EdgeFlags& flags) {
  std::vector<double> angle(at(surface.vertices.rows()), 0.0);
  std::vector<char> inside(angle.size(), 1);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
    const auto p = [&](HalfedgeId g) {
      return Vector3(surface.vertices.row(mesh::source(surface.faces, g)).transpose());
    };
    const Vector3 a = p(next_corner(h)) - p(h);
    const Vector3 b = p(previous_corner(h)) - p(h);
    angle[at(mesh::source(surface.faces, h))] += std::acos(a.dot(b) / (a.norm() * b.norm()));
    if (flags[at(h)] == 0) continue;
    inside[at(mesh::source(surface.faces, h))] = inside[at(mesh::target(surface.faces, h))] = 0;
  }
  double most = 0.0;
  for (std::size_t v = 0; v < angle.size(); ++v) {
    if (inside[v] != 0) most = std::max(most, std::abs(angle[v] - 2 * std::numbers::pi));
  }
  return most;
}

Index islands_of(const mesh::Surface& surface, const mesh::EdgeFlags& flags) {
  return mesh::components_between(surface.adjacency(), flags).count;
}

TEST(Nets, plates_with_holes_unfold_without_stretch) {
  const mesh::Surface plate = test::of_cubes(test::plate(2), 3);
  const mesh::EdgeFlags flags = nets_of(plate);
  EXPECT_GT(edges_of(flags), 0);
  EXPECT_LT(most_curvature_inside(plate, flags), 1e-9);
}

TEST(Nets, a_cylinder_is_a_rolled_side_and_two_caps) {
  const mesh::Surface can = turned(24, {{1, 0}, {1, 2}}, 0, 2);
  const mesh::EdgeFlags flags = nets_of(can);
  EXPECT_LT(most_curvature_inside(can, flags), 1e-9);
  // Both rims, but for an edge by which a cap may hang on the side, and one seam along it.
  EXPECT_GE(edges_of(flags), 2 * 23 + 1);
  EXPECT_LE(edges_of(flags), 2 * 24 + 1);
}

TEST(Nets, long_strips_are_divided) {
  const mesh::Surface ring = turned(64, {{8, 0}, {8, 0.5}, {7, 0.5}, {7, 0.1}}, 0.1, 0.1);
  const mesh::EdgeFlags flags = nets_of(ring);
  if (edges_of(flags) > 0) {
    EXPECT_GT(islands_of(ring, flags), 2);
  }
}

TEST(Nets, are_the_same_for_any_place_and_unit) {
  mesh::Surface plate = test::of_cubes(test::plate(1), 2);
  const mesh::EdgeFlags flags = nets_of(plate);
  const double c = std::cos(0.7);
  const double s = std::sin(0.7);
  for (Eigen::Index v = 0; v < plate.vertices.rows(); ++v) {
    const Vector3 p = plate.vertices.row(v).transpose();
    plate.vertices.row(v) << 8 * (c * p.x() - s * p.z()) + 1, 8 * p.y(),
        8 * (s * p.x() + c * p.z());
  }
  EXPECT_EQ(nets_of(plate), flags);
}

TEST(Nets, round_things_have_none) {
  EXPECT_EQ(edges_of(nets_of(test::sphere(24, 12))), 0);
  EXPECT_EQ(edges_of(nets_of(test::torus(24, 12))), 0);
}

}  // namespace
}  // namespace flipfree::unwrap::seams_test
