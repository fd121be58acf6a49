#include "support/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace flipfree::test {
namespace {

using std::numbers::pi;

// Joins a lattice of vertices id(column, row) into triangles; columns and rows count cells.
template <typename Id>
Triangles lattice_faces(Index columns, Index rows, Id id) {
  Triangles faces(2 * columns * rows, 3);
  Eigen::Index f = 0;
  for (Index j = 0; j < rows; ++j) {
    for (Index i = 0; i < columns; ++i) {
      faces.row(f++) << id(i, j), id(i + 1, j), id(i + 1, j + 1);
      faces.row(f++) << id(i, j), id(i + 1, j + 1), id(i, j + 1);
    }
  }
  return faces;
}

// The points place(i, j) as vertices id(i, j), joined; where several have one id, the first
// decides.
template <typename Id, typename Place>
mesh::Surface lattice(Index columns, Index rows, Index vertices, Id id, Place place) {
  mesh::Surface surface;
  surface.vertices.resize(vertices, 3);
  for (Index j = rows; j >= 0; --j) {
    for (Index i = columns; i >= 0; --i) surface.vertices.row(id(i, j)) = place(i, j).transpose();
  }
  surface.faces = lattice_faces(columns, rows, id);
  return surface;
}

// Of radius 1, open at both ends.
mesh::Surface rolled(Index sectors, Index rings, double step) {
  return lattice(
      sectors, rings, sectors * (rings + 1),
      [=](Index i, Index j) { return j * sectors + i % sectors; },
      [=](Index i, Index j) {
        const double phi = 2 * pi * i / sectors;
        return Vector3(std::cos(phi), std::sin(phi), j * step);
      });
}

Triangles as_rows(const std::vector<std::array<VertexId, 3>>& faces) {
  return Eigen::Map<const Triangles>(faces.data()->data(), static_cast<Eigen::Index>(faces.size()),
                                     3);
}

}  // namespace

mesh::Surface bumpy_grid(Index columns, Index rows, double height, double frequency) {
  return lattice(
      columns, rows, (columns + 1) * (rows + 1),
      [=](Index i, Index j) { return j * (columns + 1) + i; },
      [=](Index i, Index j) {
        const double x = static_cast<double>(i) / columns;
        const double y = static_cast<double>(j) / rows;
        return Vector3(x, y, height * std::sin(frequency * pi * x) * std::sin(frequency * pi * y));
      });
}

mesh::Surface grid(Index columns, Index rows) { return bumpy_grid(columns, rows, 0.0, 1.0); }

mesh::Surface sphere(Index sectors, Index rings) {
  mesh::Surface surface;
  surface.vertices.resize(2 + sectors * (rings - 1), 3);
  surface.vertices.row(0) << 0, 0, 1;
  surface.vertices.row(1) << 0, 0, -1;
  const auto id = [&](Index i, Index j) { return 2 + (j - 1) * sectors + i % sectors; };
  for (Index j = 1; j < rings; ++j) {
    for (Index i = 0; i < sectors; ++i) {
      const double theta = pi * j / rings;
      const double phi = 2 * pi * i / sectors;
      surface.vertices.row(id(i, j)) << std::sin(theta) * std::cos(phi),
          std::sin(theta) * std::sin(phi), std::cos(theta);
    }
  }
  std::vector<std::array<VertexId, 3>> faces;
  for (Index i = 0; i < sectors; ++i) faces.push_back({0, id(i, 1), id(i + 1, 1)});
  for (Index j = 1; j + 1 < rings; ++j) {
    for (Index i = 0; i < sectors; ++i) {
      faces.push_back({id(i, j), id(i, j + 1), id(i + 1, j + 1)});
      faces.push_back({id(i, j), id(i + 1, j + 1), id(i + 1, j)});
    }
  }
  for (Index i = 0; i < sectors; ++i) faces.push_back({1, id(i + 1, rings - 1), id(i, rings - 1)});
  surface.faces = as_rows(faces);
  return surface;
}

mesh::Surface torus(Index sectors, Index rings, double minor) {
  return lattice(
      sectors, rings, sectors * rings,
      [=](Index i, Index j) { return (j % rings) * sectors + i % sectors; },
      [=](Index i, Index j) {
        const double phi = 2 * pi * i / sectors;
        const double theta = 2 * pi * j / rings;
        const double r = 1 + minor * std::cos(theta);
        return Vector3(r * std::cos(phi), r * std::sin(phi), minor * std::sin(theta));
      });
}

mesh::Surface cylinder(Index sectors, Index rings) { return rolled(sectors, rings, 1.0 / rings); }

std::vector<Cell> plate(Index holes) {
  std::vector<Cell> cells;
  for (Index x = 0; x < 2 * holes + 1; ++x) {
    for (Index y = 0; y < 3; ++y) {
      if (x % 2 == 0 || y != 1) cells.push_back({x, y, 0});
    }
  }
  return cells;
}

mesh::Surface of_cubes(const std::vector<Cell>& cells, Index n) {
  const std::set<Cell> solid(cells.begin(), cells.end());
  std::map<Cell, VertexId> ids;  // in units of 1/n
  std::vector<std::array<VertexId, 3>> faces;
  for (const Cell& cell : solid) {
    for (Index side = 0; side < 6; ++side) {
      const auto axis = at(side / 2);
      const bool up = side % 2 == 1;
      Cell other = cell;
      other[axis] += up ? 1 : -1;
      if (solid.contains(other)) continue;
      // Two axes that turn counter-clockwise seen from outside.
      const std::size_t first = (axis + (up ? 1 : 2)) % 3, second = (axis + (up ? 2 : 1)) % 3;
      const auto id = [&](Index x, Index y) {
        Cell p = {cell[0] * n, cell[1] * n, cell[2] * n};
        p[axis] += up ? n : 0;
        p[first] += x;
        p[second] += y;
        return ids.try_emplace(p, static_cast<VertexId>(ids.size())).first->second;
      };
      for (Index x = 0; x < n; ++x) {
        for (Index y = 0; y < n; ++y) {
          faces.push_back({id(x, y), id(x + 1, y), id(x + 1, y + 1)});
          faces.push_back({id(x, y), id(x + 1, y + 1), id(x, y + 1)});
        }
      }
    }
  }
  mesh::Surface surface;
  surface.vertices.resize(static_cast<Eigen::Index>(ids.size()), 3);
  for (const auto& [p, v] : ids) surface.vertices.row(v) << p[0], p[1], p[2];
  surface.vertices /= n;
  surface.faces = as_rows(faces);
  return surface;
}

mesh::Surface tetrahedron() {
  mesh::Surface surface;
  surface.vertices.resize(4, 3);
  surface.vertices << 1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1;
  surface.faces = Triangles{{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return surface;
}

mesh::Surface tube(Index sectors, Index rings) {
  mesh::Surface surface = rolled(sectors, rings - 1, 1.0);
  const VertexId tip = sectors * rings;
  surface.vertices.conservativeResize(tip + 1, 3);
  surface.vertices.row(tip) << 0, 0, rings;
  Triangles faces = surface.faces;
  faces.conservativeResize(faces.rows() + sectors, 3);
  for (Index s = 0; s < sectors; ++s)
    faces.bottomRows(sectors).row(s) << tip - sectors + s, tip - sectors + (s + 1) % sectors, tip;
  surface.faces = std::move(faces);
  return surface;
}

mesh::Surface stacked(Index vertices, Stacking stacking, unsigned seed) {
  std::vector<std::array<VertexId, 3>> faces{{0, 1, 2}};
  mesh::Surface surface;
  surface.vertices.resize(vertices, 3);
  surface.vertices.topRows(3) << 0, 0, 0, 1, 0, 1, 0, 1, 1;
  std::mt19937 random(seed);
  for (VertexId v = 3; v < vertices; ++v) {
    const auto newest = std::min<std::size_t>(faces.size(), 3);
    const std::size_t k = stacking == Stacking::kRandom ? random() % faces.size()
                          : stacking == Stacking::kDeep ? faces.size() - 1
                                                        : faces.size() - 1 - random() % newest;
    const auto [a, b, c] = faces[k];
    surface.vertices.row(v) =
        (surface.vertices.row(a) + surface.vertices.row(b) + surface.vertices.row(c)) / 3;
    faces[k] = {a, b, v};
    faces.push_back({b, c, v});
    faces.push_back({c, a, v});
  }
  surface.faces = as_rows(faces);
  return surface;
}

mesh::Surface beside(const mesh::Surface& first, const mesh::Surface& second) {
  mesh::Surface both;
  both.vertices.resize(first.vertices.rows() + second.vertices.rows(), 3);
  both.vertices << first.vertices, second.vertices.array() + 20.0;
  Triangles faces(first.faces.rows() + second.faces.rows(), 3);
  faces << first.faces.triangles(),
      second.faces.triangles().array() + static_cast<Index>(first.vertices.rows());
  both.faces = std::move(faces);
  return both;
}

}  // namespace flipfree::test
