// Surfaces with what fields on them need, for the tests of this stage.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "flipfree/field/cross_field.h"
#include "support/shapes.h"

namespace flipfree::field {

inline constexpr double kTestQuarter = 0.5 * std::numbers::pi;

struct Place {
  explicit Place(mesh::Surface given)
      : surface(std::move(given)),
        adjacency(
            mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces)),
        frames(measure_frames(surface)) {}

  std::size_t faces() const { return static_cast<std::size_t>(surface.faces.rows()); }
  CrossField random_field(unsigned seed) const {
    std::mt19937 random(seed);
    std::vector<double> angle(faces());
    for (double& a : angle) a = std::uniform_real_distribution<double>(-3.0, 3.0)(random);
    return match_nearest(adjacency, frames, std::move(angle));
  }

  mesh::Surface surface;
  mesh::Adjacency adjacency;
  Frames frames;
};

// Closed surfaces of genus 0, 1, 2, and ones with one and two boundary loops.
inline std::vector<Place> places() {
  std::vector<Place> all;
  for (mesh::Surface& s : std::vector<mesh::Surface>{
           test::sphere(8, 6), test::torus(12, 8), test::perforated_plate(2, 1),
           test::bumpy_grid(5, 4, 0.3, 1.0), test::cylinder(9, 4)})
    all.emplace_back(std::move(s));
  return all;
}

}  // namespace flipfree::field
