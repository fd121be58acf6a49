#include "planar_maps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flipfree/mesh/adjacency.h"
#include "meshes.h"
#include "rational.h"
#include "support/shapes.h"

namespace flipfree::fuzz {
namespace {

bool positive(const PlanarMap& map, FaceId f) {
  const auto at = [&](Index k) { return exact(map.uv.row(map.cut.faces(f, k)).transpose()); };
  return side(at(0), at(1), at(2)) > 0;
}

bool positive(const PlanarMap& map) {
  if (!map.uv.allFinite()) return false;
  for (FaceId f = 0; f < map.cut.faces.rows(); ++f) {
    if (!positive(map, f)) return false;
  }
  return true;
}

// A surface and a place in the plane for each of its vertices; a ring has two columns of vertices
// at its seam, of which the second is used by the corners there.
struct Plan {
  mesh::Surface surface;
  Points2 corner;  // 3 #F x 2
};

Points2 by_vertex(const mesh::Surface& surface, const Points2& places) {
  Points2 corner(3 * surface.faces.rows(), 2);
  for (CornerId c = 0; c < corner.rows(); ++c)
    corner.row(c) = places.row(surface.faces(c / 3, c % 3));
  return corner;
}

mesh::Surface integer_grid(Bytes& bytes, Index most) {
  const Index columns = bytes.between(1, most);
  const Index rows = bytes.between(1, most);
  mesh::Surface surface = test::grid(columns, rows);
  surface.vertices.col(0) = (surface.vertices.col(0) * columns).array().round();
  surface.vertices.col(1) = (surface.vertices.col(1) * rows).array().round();
  return surface;
}

// A strip wound around the origin so many half turns, glued to itself where that closes it.
Plan ring(Bytes& bytes) {
  const Index columns = bytes.between(3, 9);
  const Index half_turns = bytes.between(1, 4);
  const bool glued = bytes.flag() && half_turns % 2 == 0;
  Plan plan;
  plan.surface = test::grid(columns, 1);
  Points2 places(plan.surface.vertices.rows(), 2);
  const double drift = bytes.eighth() / 16.0;
  for (VertexId v = 0; v < places.rows(); ++v) {
    const Index column = glued ? v % (columns + 1) % columns : v % (columns + 1);
    const double angle = std::numbers::pi * half_turns * column / columns;
    const double radius = 2.0 - (v > columns ? 1.0 : 0.0) + (glued ? 0.0 : drift * angle);
    places.row(v) << radius * std::cos(angle), radius * std::sin(angle);
  }
  if (glued) {
    Triangles faces = plan.surface.faces;
    for (VertexId& v : faces.reshaped()) {
      if (v % (columns + 1) == columns) v -= columns;
    }
    plan.surface.faces = std::move(faces);
  }
  plan.corner = by_vertex(plan.surface, places);
  return plan;
}

Plan read_plan(Bytes& bytes) {
  Plan plan;
  switch (bytes.below(5)) {
    case 0:
    case 1:
      plan.surface = integer_grid(bytes, 4);
      break;
    case 2:
      plan.surface = test::stacked(bytes.between(4, 12), test::Stacking::kMixed, bytes.byte());
      break;
    case 3:
      return ring(bytes);
    default: {  // two pieces, one on top of the other
      const mesh::Surface one = integer_grid(bytes, 2);
      const mesh::Surface two = integer_grid(bytes, 2);
      plan.surface.vertices.resize(one.vertices.rows() + two.vertices.rows(), 3);
      plan.surface.vertices << one.vertices, two.vertices;
      Triangles faces(one.faces.rows() + two.faces.rows(), 3);
      faces << one.faces.triangles(),
          two.faces.triangles().array() + static_cast<Index>(one.vertices.rows());
      plan.surface.faces = std::move(faces);
    }
  }
  plan.corner = by_vertex(plan.surface, plan.surface.vertices.leftCols<2>());
  return plan;
}

// Flags some edges at random: single ones, and all between two sets of faces.
mesh::EdgeFlags read_cuts(Bytes& bytes, const mesh::Adjacency& adjacency) {
  mesh::EdgeFlags flags(adjacency.opposite.size(), 0);
  const auto cut = [&](HalfedgeId h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    if (o != kInvalid) flags[static_cast<std::size_t>(h)] = flags[static_cast<std::size_t>(o)] = 1;
  };
  const auto count = static_cast<Index>(flags.size());
  for (Index n = bytes.below(8); n > 0; --n) cut(bytes.below(count));
  if (bytes.below(3) == 0) {
    const FaceId from = bytes.below(count / 3);
    for (HalfedgeId h = 0; h < count; ++h) {
      const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
      if (o != kInvalid && h / 3 < from && o / 3 >= from) cut(h);
    }
  }
  return flags;
}

// Moves one vertex of the cut mesh, or a whole chart.
void move(PlanarMap& map, Bytes& bytes, bool may_flip) {
  const Points2 before = map.uv;
  const auto count = static_cast<Index>(map.uv.rows());
  const Index v = bytes.below(count);
  switch (bytes.below(6)) {
    case 0:
      map.uv.row(v) += Eigen::RowVector2d(bytes.eighth(), bytes.eighth());
      break;
    case 1:
      map.uv.row(v) += Eigen::RowVector2d(bytes.fraction(), bytes.fraction());
      break;
    case 2:
      map.uv.row(v) = map.uv.row(bytes.below(count)).eval();
      break;
    case 3:  // by a bit
      map.uv(v, bytes.below(2)) = std::nextafter(map.uv(v, 0), bytes.flag() ? HUGE_VAL : -HUGE_VAL);
      break;
    case 4: {  // the chart of a vertex, turned and moved
      const mesh::Adjacency adjacency = mesh::build_adjacency(count, map.cut.faces);
      const mesh::Components charts = mesh::face_components(adjacency);
      const ChartId chart = charts.of_face[static_cast<std::size_t>(
          adjacency.vertex_halfedge[static_cast<std::size_t>(v)] / 3)];
      const Index turns = bytes.below(4);
      const Vector2 by(bytes.eighth(), bytes.eighth());
      for (VertexId w = 0; w < count; ++w) {
        const HalfedgeId h = adjacency.vertex_halfedge[static_cast<std::size_t>(w)];
        if (charts.of_face[static_cast<std::size_t>(h / 3)] != chart) continue;
        Vector2 p = map.uv.row(w);
        for (Index k = 0; k < turns; ++k) p = Vector2(-p.y(), p.x());
        map.uv.row(w) = (p + by).transpose();
      }
      break;
    }
    default:
      map.uv *= std::ldexp(1.0, bytes.below(81) - 40);
      if (bytes.flag()) map.uv.rowwise() += Eigen::RowVector2d(bytes.eighth(), bytes.fraction());
      break;
  }
  if (!may_flip && !positive(map)) map.uv = before;
}

}  // namespace

Points2 PlanarMap::corner_uv() const {
  Points2 corner(3 * cut.faces.rows(), 2);
  for (CornerId c = 0; c < corner.rows(); ++c) corner.row(c) = uv.row(cut.faces(c / 3, c % 3));
  return corner;
}

PlanarMap read_planar_map(Bytes& bytes, bool may_flip) {
  Plan plan = read_plan(bytes);
  PlanarMap map;
  map.surface = std::move(plan.surface);
  if (map.surface.vertices.rows() > map.surface.faces.triangles().maxCoeff() + 1)
    map.surface.vertices.conservativeResize(map.surface.faces.triangles().maxCoeff() + 1, 3);
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  map.cut = mesh::cut_along(map.surface.faces, adjacency, read_cuts(bytes, adjacency));
  map.uv.resize(static_cast<Eigen::Index>(map.cut.vertex_origin.size()), 2);
  for (CornerId c = 0; c < plan.corner.rows(); ++c)
    map.uv.row(map.cut.faces(c / 3, c % 3)) = plan.corner.row(c);
  if (!may_flip && !positive(map)) {
    map.uv.col(0) *= -1.0;  // a strip wound clockwise
  }
  for (Index n = bytes.below(24); n > 0 && !bytes.empty(); --n) {
    // The judges want positive triangles most of the time.
    move(map, bytes, may_flip && bytes.below(8) == 0);
  }
  return map;
}

}  // namespace flipfree::fuzz
