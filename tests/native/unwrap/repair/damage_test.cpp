#include "flipfree/unwrap/repair/patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/base/stats.h"
#include "unwrap/repair/charts.h"

namespace flipfree::unwrap::damage_test {
namespace {

using test_charts::Sheet;

TEST(Damage, a_sound_map_has_none) {
  EXPECT_EQ(Sheet(6).damage().count, 0);
  EXPECT_EQ(Sheet(6).damage(true).count, 0);
}

TEST(Damage, flipped_collapsed_and_guessed_faces_are_bad) {
  Sheet sheet(6, 0.0);
  sheet.chart.unknown[0] = 1;
  sheet.uv.row(24) = sheet.uv.row(25);
  const Damage damage = sheet.damage();
  for (FaceId f = 0; f < sheet.surface.faces.rows(); ++f) {
    const auto corners = sheet.surface.faces.row(f);
    const bool both = (corners.array() == 24).any() && (corners.array() == 25).any();
    if (both || (corners.array() == 0).any()) {
      EXPECT_TRUE(damage.bad[static_cast<std::size_t>(f)]);
    }
  }
}

TEST(Damage, a_vertex_wound_twice_is_bad_though_all_faces_are_positive) {
  // A fan of eight faces, twice around.
  mesh::Surface surface;
  surface.vertices = Points3::Zero(9, 3);
  surface.faces.resize(8, 3);
  Points2 uv = Points2::Zero(9, 2);
  for (Index i = 0; i < 8; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 8.0;
    surface.vertices.row(i + 1) << std::cos(angle), std::sin(angle), 0.0;
    uv.row(i + 1) << std::cos(2.0 * angle), std::sin(2.0 * angle);
    surface.faces.row(i) << 0, i + 1, (i + 1) % 8 + 1;
  }
  const mesh::Adjacency adjacency = mesh::build_adjacency(9, surface.faces);
  const DamagedChart chart{
      surface, adjacency, face_areas(surface), std::vector<char>(9), std::vector<char>(9), 1.0};
  const std::vector<double> energies = face_energies(surface, uv, 1.0);
  EXPECT_EQ(find_damage(chart, uv, energies, healthy_energy(chart.area, energies), false,
                        ExecutionContext())
                .count,
            8);
}

TEST(Damage, what_is_drawn_out_counts_beside_damage_or_in_a_spoilt_chart) {
  Sheet sheet(10, 0.0);
  sheet.uv.row(60) << 0.5, 0.5 + 0.0999;  // as good as collapsed, positive
  ASSERT_EQ(sheet.damage(false).count, 0);
  EXPECT_GT(sheet.damage(true).count, 0);
}

TEST(Damage, a_vertex_of_many_bad_faces_is_looked_around_once) {
  const Index count = 100'000;
  mesh::Surface surface;
  surface.vertices = Points3::Zero(count + 1, 3);
  surface.faces.resize(count, 3);
  Points2 uv = Points2::Zero(count + 1, 2);
  for (Index i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    surface.vertices.row(i + 1) << std::cos(angle), std::sin(angle), 0.0;
    uv.row(i + 1) << std::cos(angle), -std::sin(angle);
    surface.faces.row(i) << 0, i + 1, (i + 1) % count + 1;
  }
  const mesh::Adjacency adjacency = mesh::build_adjacency(count + 1, surface.faces);
  const std::vector<char> none(static_cast<std::size_t>(count) + 1, 0);
  const DamagedChart chart{surface, adjacency, face_areas(surface), none, none, 1.0};
  const std::vector<double> energies = face_energies(surface, uv, 1.0);
  const Stopwatch watch;
  EXPECT_EQ(find_damage(chart, uv, energies, healthy_energy(chart.area, energies), false,
                        ExecutionContext())
                .count,
            count);
  EXPECT_LT(watch.seconds(), 5.0);  // the square of the number: 10^10 looks
}

TEST(Damage, density_is_that_of_most_faces) {
  Sheet sheet(10, 0.0);
  sheet.uv *= 3.0;
  sheet.uv.row(60) << 100.0, 50.0;
  const Density density = density_of(sheet.surface, sheet.chart.area, sheet.uv);
  EXPECT_NEAR(density.value, 3.0, 1e-12);
  EXPECT_GT(density.share, 0.9);
  EXPECT_LT(density.share, 1.0);
  EXPECT_EQ(density_of(sheet.surface, sheet.chart.area, Points2::Zero(121, 2)).value, 0.0);
}

TEST(Damage, places_that_are_guesses_say_nothing_about_density) {
  Sheet sheet(10, 0.0);
  std::vector<char> unknown(121, 0);
  for (Eigen::Index v = 0; v < 66; ++v) {  // of 121 in rows of 11
    sheet.uv(v, 1) = 7.0 * (sheet.uv(v, 1) - 1.0);
    unknown[static_cast<std::size_t>(v)] = 1;
  }
  EXPECT_GT(density_of(sheet.surface, sheet.chart.area, sheet.uv).value, 2.0);
  EXPECT_NEAR(density_of(sheet.surface, sheet.chart.area, sheet.uv, unknown).value, 1.0, 1e-12);
}

TEST(Damage, median_by_weight) {
  EXPECT_EQ(weighted_median({}), 0.0);
  EXPECT_EQ(weighted_median({{3.0, 1.0}, {1.0, 1.0}, {2.0, 1.0}}), 2.0);
  EXPECT_EQ(weighted_median({{3.0, 5.0}, {1.0, 1.0}, {2.0, 1.0}}), 3.0);
}

TEST(Damage, vertices_in_one_place_are_stacked) {
  Points2 uv(4, 2);
  uv << 0, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_EQ(stacked_vertices(uv), (std::vector<char>{1, 0, 1, 0}));
}

}  // namespace
}  // namespace flipfree::unwrap::damage_test
