#include "flipfree/quads/flat_surface.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::quads {

namespace {

// The largest power of two that all coordinates are multiples of; 1 where all are zero.
int grid_exponent(const Points2f& uv) {
  int least = 1000;
  for (Eigen::Index i = 0; i < uv.size(); ++i) {
    const float x = uv.data()[i];
    if (x == 0.0F) continue;
    int exponent = 0;
    // 24 bits of the mantissa as a whole number.
    auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 24));
    exponent -= 24;
    while (mantissa % 2 == 0) {
      mantissa /= 2;
      ++exponent;
    }
    least = std::min(least, exponent);
  }
  return least == 1000 ? 0 : least;
}

[[noreturn]] void refuse(const std::string& what, ElementKind kind = ElementKind::kNone,
                         std::vector<Index> elements = {}) {
  throw_invalid(ErrorCode::kBadShape, what, kind, std::move(elements));
}

}  // namespace

FlatMap flat_map(const certify::Parametrization& map) {
  const Triangles& faces = map.surface.faces;
  const Points2f& uv = map.uv32;
  if (!uv.allFinite()) refuse("The map has coordinates that are not finite. Map the surface anew.");
  const int exponent = grid_exponent(uv);
  const double unit = std::ldexp(1.0, exponent);
  const double largest = uv.size() == 0 ? 0.0 : static_cast<double>(uv.cwiseAbs().maxCoeff());
  if (!(largest / unit < 0.25 * static_cast<double>(kLongest)))
    refuse("The map's stored coordinates lie on no common grid. Give a map that is seamless.");
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), faces);
  FlatMap flat;
  flat.unit = unit;
  FlatSurface& s = flat.surface;
  s.opposite = adjacency.opposite;
  const std::size_t count = s.opposite.size();
  s.turn.assign(count, 0);
  for (HalfedgeId h = 0; at(h) < count; ++h) {
    const auto on_grid = [&](CornerId c, int k) {
      return static_cast<std::int64_t>(std::ldexp(static_cast<double>(uv(c, k)), -exponent));
    };
    const HalfedgeId n = next_corner(h);
    s.source.push_back(mesh::source(faces, h));
    s.edge.push_back({on_grid(n, 0) - on_grid(h, 0), on_grid(n, 1) - on_grid(h, 1)});
  }
  for (FaceId f = 0; 3 * at(f) < count; ++f) {
    if (s.twice_area(f) <= 0)
      refuse("Face " + face_id(f) + " of the map has no positive area. Give a valid map.",
             ElementKind::kFace, {f});
  }
  for (HalfedgeId h = 0; at(h) < count; ++h) {
    const HalfedgeId o = s.opposite[at(h)];
    const Gauss e = s.edge[at(h)];
    if (o == kInvalid) {
      if (e.x != 0 && e.y != 0) flat.oblique.push_back(h);
      continue;
    }
    Index turn = 0;
    while (turn < 4 && !(s.edge[at(o)] == -turned(e, turn))) ++turn;
    if (turn == 4)
      refuse("Edge " + vertex_id(s.source[at(h)]) + "-" + vertex_id(s.target(h)) +
                 " does not match across its seam. Give a map that is seamless as stored.",
             ElementKind::kEdge, {s.source[at(h)], s.target(h)});
    s.turn[at(h)] = turn;
  }
  return flat;
}

std::vector<Index> quarters_around(const FlatSurface& surface, std::size_t vertices) {
  std::vector<double> angle(vertices, 0.0);
  for (HalfedgeId h = 0; h < surface.halfedges(); ++h) {
    const Gauss a = surface.edge[at(h)], b = -surface.edge[at(previous_corner(h))];
    angle[at(surface.source[at(h)])] +=
        std::atan2(static_cast<double>(cross(a, b)), static_cast<double>(dot(a, b)));
  }
  std::vector<Index> quarters;
  for (const double sum : angle)
    quarters.push_back(static_cast<Index>(std::lround(sum / kQuarterTurn)));
  return quarters;
}

Diamond diamond(const FlatSurface& surface, const std::vector<Gauss>& edge, HalfedgeId h) {
  const HalfedgeId o = surface.opposite[at(h)];
  Diamond d;
  d.before = edge[at(previous_corner(h))];
  d.diagonal = d.before + turned(edge[at(next_corner(o))], surface.turn[at(o)]);
  d.across = d.before + edge[at(h)];
  return d;
}

std::array<Moved, 4> flip(FlatSurface& s, HalfedgeId h) {
  const HalfedgeId o = s.opposite[at(h)];
  const FaceId f = h / 3, g = o / 3;
  const Index turn = s.turn[at(o)];
  const Diamond d = diamond(s, s.edge, h);
  const VertexId a = s.source[at(previous_corner(h))], b = s.source[at(previous_corner(o))];
  const std::array<Moved, 4> moved = {
      Moved{previous_corner(h), 3 * f, 0}, Moved{next_corner(o), 3 * f + 1, turn},
      Moved{previous_corner(o), 3 * g + 1, turn}, Moved{next_corner(h), 3 * g + 2, 0}};
  struct Side {
    VertexId source;
    HalfedgeId opposite;
    Index turn;
    Gauss edge;
  };
  std::array<Side, 4> side;
  for (std::size_t i = 0; i < 4; ++i) {
    const HalfedgeId from = moved[i].from;
    HalfedgeId across = s.opposite[at(from)];
    // Vectors of the side turn with its chart, and those of its neighbour if that moves as well.
    Index by = s.turn[at(from)] - moved[i].turn;
    for (const Moved& other : moved) {
      if (other.from != across) continue;
      across = other.to;
      by += other.turn;
      break;
    }
    side[i] = {s.source[at(from)], across, across == kInvalid ? 0 : by & 3,
               turned(s.edge[at(from)], moved[i].turn)};
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t to = at(moved[i].to);
    s.source[to] = side[i].source;
    s.opposite[to] = side[i].opposite;
    s.turn[to] = side[i].turn;
    s.edge[to] = side[i].edge;
    if (side[i].opposite == kInvalid) continue;
    s.opposite[at(side[i].opposite)] = moved[i].to;
    s.turn[at(side[i].opposite)] = -side[i].turn & 3;
  }
  const std::size_t back = at(3 * f + 2), forth = at(3 * g);
  s.source[back] = b;
  s.source[forth] = a;
  s.edge[back] = -d.diagonal;
  s.edge[forth] = d.diagonal;
  s.opposite[back] = static_cast<HalfedgeId>(forth);
  s.opposite[forth] = static_cast<HalfedgeId>(back);
  s.turn[back] = s.turn[forth] = 0;
  return moved;
}

}  // namespace flipfree::quads
