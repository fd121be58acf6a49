// Maps of single charts for the tests of what mends them.
#pragma once

#include <vector>

#include "flipfree/unwrap/repair/patches.h"
#include "support/shapes.h"

namespace flipfree::unwrap::test_charts {

// A sheet over the unit square with its projection as map.
struct Sheet {
  mesh::Surface surface;
  mesh::Adjacency adjacency;
  DamagedChart chart;
  Points2 uv;

  explicit Sheet(Index cells, double height = 0.1)
      : surface(test::bumpy_grid(cells, cells, height, 2.0)),
        adjacency(
            mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces)),
        chart{surface,
              adjacency,
              face_areas(surface),
              std::vector<char>(static_cast<std::size_t>(surface.vertices.rows()), 0),
              std::vector<char>(static_cast<std::size_t>(surface.vertices.rows()), 0),
              1.0},
        uv(surface.vertices.leftCols<2>()) {}
  Sheet(const Sheet&) = delete;
  Sheet& operator=(const Sheet&) = delete;

  Damage damage(bool spoilt = false) const {
    const std::vector<double> energies = face_energies(surface, uv, chart.density);
    return find_damage(chart, uv, energies, healthy_energy(chart.area, energies), spoilt,
                       ExecutionContext());
  }
};

}  // namespace flipfree::unwrap::test_charts
