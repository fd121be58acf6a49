#include "meshes.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "support/shapes.h"

namespace flipfree::fuzz {
namespace {

// A disk grown from one triangle: each byte puts a triangle with a new vertex beside a boundary
// edge, or closes a corner of the boundary.
mesh::Surface glued(Bytes& bytes, Index most_faces) {
  std::vector<VertexId> rim{0, 1, 2};  // surface on the left
  std::vector<Index> corners{0, 1, 2};
  std::set<std::pair<VertexId, VertexId>> edges{{0, 1}, {1, 2}, {0, 2}};
  std::vector<Vector3> places{{0, 0, 0}, {1, 0, 0}, {0.25, 1, 0}};
  const auto edge = [](VertexId a, VertexId b) -> std::pair<VertexId, VertexId> {
    return {std::min(a, b), std::max(a, b)};
  };
  Index faces = 1;
  const Index wanted = bytes.between(1, most_faces);
  while (faces < wanted && !bytes.empty()) {
    const bool close = bytes.below(3) == 0;
    const auto n = rim.size();
    const auto i = static_cast<std::size_t>(bytes.below(static_cast<Index>(n)));
    const VertexId a = rim[i];
    const VertexId b = rim[(i + 1) % n];
    const VertexId c = rim[(i + 2) % n];
    if (close) {
      // The triangle (a, c, b) covers the corner at b; three edges left would close the surface.
      if (n <= 3 || edges.contains(edge(a, c))) continue;
      corners.insert(corners.end(), {a, c, b});
      edges.insert(edge(a, c));
      rim.erase(rim.begin() + static_cast<std::ptrdiff_t>((i + 1) % n));
    } else {
      const auto d = static_cast<VertexId>(places.size());
      const Vector3 middle =
          (places[static_cast<std::size_t>(a)] + places[static_cast<std::size_t>(b)]) / 2.0;
      places.push_back(middle + Vector3(bytes.fraction(), bytes.fraction(), bytes.fraction()));
      corners.insert(corners.end(), {b, a, d});
      edges.insert(edge(a, d));
      edges.insert(edge(b, d));
      rim.insert(rim.begin() + static_cast<std::ptrdiff_t>(i + 1), d);
    }
    ++faces;
  }
  mesh::Surface surface;
  surface.vertices.resize(static_cast<Eigen::Index>(places.size()), 3);
  for (std::size_t v = 0; v < places.size(); ++v)
    surface.vertices.row(static_cast<Eigen::Index>(v)) = places[v].transpose();
  surface.faces = Triangles(Eigen::Map<const Triangles>(corners.data(), faces, 3));
  return surface;
}

mesh::Surface shape(Bytes& bytes, Kind kind, Index most_faces) {
  const Index side = most_faces >= 50 ? 5 : 3;
  switch (bytes.below(kind == Kind::kDisk ? 5 : 9)) {
    case 0:
      return glued(bytes, most_faces);
    case 1: {
      const Index columns = bytes.between(1, side);
      return test::grid(columns, bytes.between(1, side));
    }
    case 2: {
      const Index columns = bytes.between(1, side);
      const Index rows = bytes.between(1, side);
      const double height = bytes.eighth();
      return test::bumpy_grid(columns, rows, height, bytes.eighth());
    }
    case 3: {
      const auto stacking = static_cast<test::Stacking>(bytes.below(3));
      return test::stacked(bytes.between(4, most_faces / 2 + 2), stacking, bytes.byte());
    }
    case 4: {
      const Index sectors = bytes.between(3, 6);
      return test::tube(sectors, bytes.between(1, std::max(1, most_faces / (2 * sectors) - 1)));
    }
    case 5:
      return test::cylinder(bytes.between(3, 6), bytes.between(1, std::max(1, side - 1)));
    case 6:
      return test::torus(3, 3);
    case 7:
      return test::sphere(bytes.between(3, 5), bytes.between(2, 3));
    default:
      return test::tetrahedron();
  }
}

// Without unused vertices, in the order of their ids.
void drop_unused(mesh::Surface& surface) {
  std::vector<VertexId> renamed(static_cast<std::size_t>(surface.vertices.rows()), kInvalid);
  Triangles faces = surface.faces;
  for (const VertexId v : faces.reshaped()) renamed[static_cast<std::size_t>(v)] = 0;
  Index count = 0;
  for (std::size_t v = 0; v < renamed.size(); ++v) {
    if (renamed[v] == kInvalid) continue;
    renamed[v] = count;
    surface.vertices.row(count++) = surface.vertices.row(static_cast<Eigen::Index>(v)).eval();
  }
  surface.vertices.conservativeResize(count, 3);
  for (VertexId& v : faces.reshaped()) v = renamed[static_cast<std::size_t>(v)];
  surface.faces = std::move(faces);
}

bool is_mesh(const mesh::Surface& surface, Kind kind) {
  mesh::ValidateOptions options;
  options.reject_zero_area = false;
  options.require_connected = kind != Kind::kAny;
  options.require_disk = kind == Kind::kDisk;
  return mesh::find_defects(surface, options).empty();
}

// One face less, or one face split into three; left alone if the result is not of the kind.
void change_connectivity(mesh::Surface& surface, Bytes& bytes, Kind kind) {
  mesh::Surface changed = surface;
  Triangles faces = surface.faces;
  const Index f = bytes.below(static_cast<Index>(surface.faces.rows()));
  const Eigen::Index last = surface.faces.rows() - 1;
  if (bytes.flag()) {
    if (last == 0) return;
    faces.row(f) = faces.row(last).eval();
    faces.conservativeResize(last, 3);
    changed.faces = std::move(faces);
    drop_unused(changed);
  } else {
    const auto v = static_cast<VertexId>(surface.vertices.rows());
    const VertexId a = surface.faces(f, 0);
    const VertexId b = surface.faces(f, 1);
    const VertexId c = surface.faces(f, 2);
    changed.vertices.conservativeResize(v + 1, 3);
    changed.vertices.row(v) =
        (surface.vertices.row(a) + surface.vertices.row(b) + surface.vertices.row(c)) / 3.0;
    faces.conservativeResize(last + 3, 3);
    faces.row(f) << a, b, v;
    faces.row(last + 1) << b, c, v;
    faces.row(last + 2) << c, a, v;
    changed.faces = std::move(faces);
  }
  if (is_mesh(changed, kind)) surface = std::move(changed);
}

void change_places(Points3& vertices, Bytes& bytes) {
  const auto count = static_cast<Index>(vertices.rows());
  const Index v = bytes.below(count);
  const Index axis = bytes.below(3);
  switch (bytes.below(5)) {
    case 0:
      vertices(v, axis) += bytes.fraction();
      break;
    case 1:
      vertices(v, axis) = bytes.number();
      break;
    case 2:  // onto another vertex, or nearly
      vertices.row(v) = vertices.row(bytes.below(count)).eval();
      if (bytes.flag()) vertices(v, axis) += std::pow(10.0, -bytes.below(20));
      break;
    case 3:  // flattened or drawn out
      vertices.col(axis) *= std::pow(10.0, bytes.below(601) - 300);
      break;
    default:  // everything in another unit
      vertices *= std::pow(10.0, bytes.below(401) - 200);
      break;
  }
  for (double& x : vertices.reshaped()) {
    if (!std::isfinite(x)) x = 1.0;
  }
}

}  // namespace

mesh::Surface read_mesh(Bytes& bytes, Kind kind, Index most_faces) {
  mesh::Surface surface = shape(bytes, kind, most_faces);
  for (Index n = bytes.below(4); n > 0; --n) change_connectivity(surface, bytes, kind);
  for (Index n = bytes.below(5); n > 0; --n) change_places(surface.vertices, bytes);
  return surface;
}

mesh::Surface read_rubbish(Bytes& bytes) {
  mesh::Surface surface;
  if (bytes.flag()) {
    surface = read_mesh(bytes, Kind::kAny, 40);
    Triangles corrupt = surface.faces;
    for (Index n = bytes.below(4); n > 0 && corrupt.rows() > 0; --n) {
      const Index f = bytes.below(static_cast<Index>(corrupt.rows()));
      corrupt(f, bytes.below(3)) = read_id(bytes, static_cast<Index>(surface.vertices.rows()));
    }
    surface.faces = std::move(corrupt);
    for (Index n = bytes.below(3); n > 0; --n)
      surface.vertices(bytes.below(static_cast<Index>(surface.vertices.rows())), bytes.below(3)) =
          bytes.any_number();
    return surface;
  }
  const Index vertices = bytes.below(9);
  Triangles faces(bytes.below(13), 3);
  surface.vertices.resize(vertices, 3);
  for (double& x : surface.vertices.reshaped()) x = bytes.any_number();
  for (VertexId& v : faces.reshaped()) v = read_id(bytes, vertices);
  surface.faces = std::move(faces);
  return surface;
}

Index read_id(Bytes& bytes, Index count) {
  const Index value = bytes.byte();
  if (value == 255) return -1 - bytes.below(3);
  if (value == 254) return count + bytes.below(3);
  return count > 0 ? value % count : value;
}

}  // namespace flipfree::fuzz
