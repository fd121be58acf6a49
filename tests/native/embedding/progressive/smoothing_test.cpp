#include "flipfree/embedding/progressive/smoothing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "embedding/progressive/valid_maps.h"

namespace flipfree::embedding::smoothing_test {
namespace {

double total_energy(const PlanarMap& map) {
  double sum = 0.0;
  for (FaceId f = 0; f < map.mesh.face_count(); ++f) sum += face_energy(map, f);
  return sum;
}

bool all_positive(const PlanarMap& map) {
  for (FaceId f = 0; f < map.mesh.face_count(); ++f) {
    if (!map.positive(f)) return false;
  }
  return true;
}

std::vector<VertexId> inner(const PlanarMap& map) {
  std::vector<VertexId> vertices;
  for (VertexId v = 0; v < map.mesh.vertex_count(); ++v) {
    if (!map.mesh.is_boundary(v)) vertices.push_back(v);
  }
  return vertices;
}

test::Disk bumpy() {
  return test::make_disk(test::bumpy_grid(12, 11, 0.2, 2.0), BoundaryShape::kSquare);
}

// A map that is far from its optimum, which the uniform one of a grid is not.
PlanarMap shaken() {
  PlanarMap map = test::valid_map(bumpy(), true);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> move(-0.02, 0.02);
  for (const VertexId v : inner(map)) {
    const Vector2 old = map.at(v);
    map.move(v, map.snap(Vector2(old + Vector2(move(random), move(random)))));
    if (!all_positive(map)) map.move(v, old);
  }
  return map;
}

TEST(Smoothing, steps_lower_the_energy_of_the_star_and_keep_it_positive) {
  for (const bool float32 : {false, true}) {
    PlanarMap map = test::valid_map(bumpy(), float32);
    Star star;
    double moved = 0.0;
    for (int round = 0; round < 3; ++round) {
      for (const VertexId v : inner(map)) {
        gather_star(map, v, star);
        ASSERT_EQ(star.ring.size(), static_cast<std::size_t>(map.mesh.degree(v)));
        const double before = star_energy(star, map.at(v));
        const Points2 uv = map.uv;
        moved += improve_vertex(map, v, star);
        gather_star(map, v, star);
        EXPECT_LE(star_energy(star, map.at(v)), before * (1 + 1e-13));
        EXPECT_TRUE(star_positive(map, star, map.at(v)));
        EXPECT_EQ(map.snap(map.at(v)), map.at(v));
        for (const VertexId other : star.ring) EXPECT_EQ(map.uv.row(other), uv.row(other));
      }
    }
    EXPECT_GT(moved, 0.0);
    EXPECT_TRUE(all_positive(map));
  }
}

TEST(Smoothing, the_centre_of_a_kernel_sees_the_whole_ring_from_anywhere) {
  PlanarMap map = test::valid_map(bumpy(), true);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-1, 1);
  Star star;
  for (const VertexId v : inner(map)) {
    map.move(v, map.snap(Vector2(place(random), place(random))));
    ASSERT_TRUE(centre_in_kernel(map, v, star));
    gather_star(map, v, star);
    EXPECT_TRUE(star_positive(map, star, map.at(v)));
  }
}

TEST(Smoothing, a_ring_without_kernel_leaves_the_vertex_alone) {
  // The ring of the middle vertex is turned round.
  test::Disk disk = test::make_disk(test::grid(2, 2), BoundaryShape::kSquare);
  Points2 uv = disk.surface.vertices.leftCols<2>();
  uv.col(0) *= -1.0;
  PlanarMap map = make_planar_map(disk.surface.faces, disk.loop, uv, true);
  Star star;
  EXPECT_FALSE(centre_in_kernel(map, 4, star));
  EXPECT_EQ(map.uv.row(4), uv.row(4));
}

TEST(Smoothing, sweeps_lower_the_energy_with_the_same_bits_for_any_number_of_threads) {
  std::vector<Points2> results;
  for (const int threads : {1, 3}) {
    PlanarMap map = shaken();
    const double before = total_energy(map);
    ExecutionContext context;
    context.threads = threads;
    smooth_sweeps(map, inner(map), 5, 1e-3, context);
    EXPECT_LT(total_energy(map), 0.99 * before);
    EXPECT_TRUE(all_positive(map));
    results.push_back(map.uv);
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(SmoothingQueue, moves_only_what_was_pushed_or_woken_and_drops_what_is_left) {
  PlanarMap map = test::valid_map(bumpy(), true);
  const Points2 before = map.uv;
  const VertexId middle = inner(map)[50];
  SmoothingQueue queue(map.mesh.vertex_count());
  queue.push(map, 0);  // on the boundary: ignored
  queue.push(map, middle);
  queue.push(map, middle);
  queue.run(map, 1, 1e9);
  Index moved = 0;
  for (VertexId v = 0; v < before.rows(); ++v) moved += map.uv.row(v) != before.row(v);
  EXPECT_LE(moved, 1);
  queue.push_star(map, middle);
  queue.run(map, 2, 0.0);  // five more are dropped
  queue.run(map, 1000, 0.0);
  moved = 0;
  for (VertexId v = 0; v < before.rows(); ++v) moved += map.uv.row(v) != before.row(v);
  EXPECT_LE(moved, 3);
  EXPECT_TRUE(all_positive(map));
}

}  // namespace
}  // namespace flipfree::embedding::smoothing_test
