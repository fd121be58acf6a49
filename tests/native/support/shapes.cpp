#include "support/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
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

Triangles as_rows(const std::vector<std::array<VertexId, 3>>& faces) {
  return Eigen::Map<const Triangles>(faces.data()->data(), static_cast<Eigen::Index>(faces.size()),
                                     3);
}

}  // namespace

mesh::Surface bumpy_grid(Index columns, Index rows, double height, double frequency) {
  mesh::Surface surface;
  surface.vertices.resize((columns + 1) * (rows + 1), 3);
  const auto id = [&](Index i, Index j) { return j * (columns + 1) + i; };
  for (Index j = 0; j <= rows; ++j) {
    for (Index i = 0; i <= columns; ++i) {
      const double x = static_cast<double>(i) / columns;
      const double y = static_cast<double>(j) / rows;
      surface.vertices.row(id(i, j)) << x, y,
          height * std::sin(frequency * pi * x) * std::sin(frequency * pi * y);
    }
  }
  surface.faces = lattice_faces(columns, rows, id);
  return surface;
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
  std::vector<Index> faces;
  for (Index i = 0; i < sectors; ++i) faces.insert(faces.end(), {0, id(i, 1), id(i + 1, 1)});
  for (Index j = 1; j + 1 < rings; ++j) {
    for (Index i = 0; i < sectors; ++i) {
      faces.insert(faces.end(), {id(i, j), id(i, j + 1), id(i + 1, j + 1)});
      faces.insert(faces.end(), {id(i, j), id(i + 1, j + 1), id(i + 1, j)});
    }
  }
  for (Index i = 0; i < sectors; ++i)
    faces.insert(faces.end(), {1, id(i + 1, rings - 1), id(i, rings - 1)});
  surface.faces = Triangles(
      Eigen::Map<const Triangles>(faces.data(), static_cast<Eigen::Index>(faces.size() / 3), 3));
  return surface;
}

mesh::Surface torus(Index sectors, Index rings, double minor) {
  mesh::Surface surface;
  surface.vertices.resize(sectors * rings, 3);
  const auto id = [&](Index i, Index j) { return (j % rings) * sectors + i % sectors; };
  for (Index j = 0; j < rings; ++j) {
    for (Index i = 0; i < sectors; ++i) {
      const double phi = 2 * pi * i / sectors;
      const double theta = 2 * pi * j / rings;
      const double r = 1 + minor * std::cos(theta);
      surface.vertices.row(id(i, j)) << r * std::cos(phi), r * std::sin(phi),
          minor * std::sin(theta);
    }
  }
  surface.faces = lattice_faces(sectors, rings, id);
  return surface;
}

mesh::Surface cylinder(Index sectors, Index rings) {
  mesh::Surface surface;
  surface.vertices.resize(sectors * (rings + 1), 3);
  const auto id = [&](Index i, Index j) { return j * sectors + i % sectors; };
  for (Index j = 0; j <= rings; ++j) {
    for (Index i = 0; i < sectors; ++i) {
      const double phi = 2 * pi * i / sectors;
      surface.vertices.row(id(i, j)) << std::cos(phi), std::sin(phi),
          static_cast<double>(j) / rings;
    }
  }
  surface.faces = lattice_faces(sectors, rings, id);
  return surface;
}

mesh::Surface perforated_plate(Index holes, Index fineness) {
  const Index width = 2 * holes + 1;
  const auto filled = [&](Index x, Index y, Index z) {
    const bool inside = x >= 0 && x < width && y >= 0 && y < 3 && z == 0;
    return inside && !(y == 1 && x % 2 == 1);
  };
  std::map<std::array<Index, 3>, VertexId> ids;
  std::vector<std::array<Index, 3>> faces;
  const auto id = [&](const std::array<Index, 3>& p) {
    return ids.try_emplace(p, static_cast<VertexId>(ids.size())).first->second;
  };
  // A square of a cube's side: from `corner` along the axes u and v, which turn counter-clockwise
  // as seen from outside.
  const auto add_side = [&](std::array<Index, 3> corner, std::size_t u, std::size_t v) {
    for (Index& c : corner) c *= fineness;
    const auto point = [&](Index i, Index j) {
      std::array<Index, 3> p = corner;
      p[u] += i;
      p[v] += j;
      return id(p);
    };
    for (Index i = 0; i < fineness; ++i) {
      for (Index j = 0; j < fineness; ++j) {
        faces.push_back({point(i, j), point(i + 1, j), point(i + 1, j + 1)});
        faces.push_back({point(i, j), point(i + 1, j + 1), point(i, j + 1)});
      }
    }
  };
  for (Index x = 0; x < width; ++x) {
    for (Index y = 0; y < 3; ++y) {
      if (!filled(x, y, 0)) continue;
      if (!filled(x + 1, y, 0)) add_side({x + 1, y, 0}, 1, 2);
      if (!filled(x - 1, y, 0)) add_side({x, y, 0}, 2, 1);
      if (!filled(x, y + 1, 0)) add_side({x, y + 1, 0}, 2, 0);
      if (!filled(x, y - 1, 0)) add_side({x, y, 0}, 0, 2);
      add_side({x, y, 1}, 0, 1);
      add_side({x, y, 0}, 1, 0);
    }
  }
  mesh::Surface s;
  s.vertices.resize(static_cast<Eigen::Index>(ids.size()), 3);
  for (const auto& [p, v] : ids) s.vertices.row(v) << p[0], p[1], p[2];
  s.vertices /= fineness;
  s.faces = as_rows(faces);
  return s;
}

mesh::Surface tetrahedron() {
  mesh::Surface surface;
  surface.vertices.resize(4, 3);
  surface.vertices << 1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1;
  surface.faces = Triangles{{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return surface;
}

mesh::Surface tube(Index sectors, Index rings) {
  mesh::Surface surface;
  surface.vertices.resize(sectors * rings + 1, 3);
  Triangles faces(2 * sectors * (rings - 1) + sectors, 3);
  for (Index r = 0; r < rings; ++r) {
    for (Index s = 0; s < sectors; ++s) {
      const double angle = 2 * std::numbers::pi * s / sectors;
      surface.vertices.row(r * sectors + s) << std::cos(angle), std::sin(angle), r;
    }
  }
  const VertexId tip = sectors * rings;
  surface.vertices.row(tip) << 0, 0, rings;
  Index f = 0;
  for (Index r = 0; r < rings; ++r) {
    for (Index s = 0; s < sectors; ++s) {
      const VertexId a = r * sectors + s;
      const VertexId b = r * sectors + (s + 1) % sectors;
      if (r + 1 == rings) {
        faces.row(f++) << a, b, tip;
        continue;
      }
      faces.row(f++) << a, b, b + sectors;
      faces.row(f++) << a, b + sectors, a + sectors;
    }
  }
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
