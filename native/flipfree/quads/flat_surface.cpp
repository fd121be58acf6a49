#include "flipfree/quads/flat_surface.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "flipfree/base/disjoint_sets.h"
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
    const auto mantissa =
        static_cast<std::uint32_t>(std::ldexp(std::frexp(std::abs(x), &exponent), 24));
    least = std::min(least, exponent - 24 + std::countr_zero(mantissa));
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
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  FlatMap flat;
  flat.unit = unit;
  FlatSurface& s = flat.surface;
  const std::size_t count = adjacency.opposite.size();
  for (HalfedgeId h = 0; at(h) < count; ++h) {
    const auto on_grid = [&](CornerId c, int k) {
      return static_cast<std::int64_t>(std::ldexp(static_cast<double>(uv(c, k)), -exponent));
    };
    const HalfedgeId n = next_corner(h);
    Side& side = s.sides.emplace_back();
    side.source = mesh::source(faces, h);
    side.opposite = adjacency.opposite[at(h)];
    side.edge = {on_grid(n, 0) - on_grid(h, 0), on_grid(n, 1) - on_grid(h, 1)};
  }
  for (FaceId f = 0; 3 * at(f) < count; ++f) {
    if (s.twice_area(f) <= 0)
      refuse("Face " + face_id(f) + " of the map has no positive area. Give a valid map.",
             ElementKind::kFace, {f});
  }
  for (HalfedgeId h = 0; at(h) < count; ++h) {
    const HalfedgeId o = s[h].opposite;
    const Gauss e = s[h].edge;
    if (o == kInvalid) {
      if (e.x != 0 && e.y != 0) flat.oblique.push_back(h);
      continue;
    }
    Index turn = 0;
    while (turn < 4 && !(s[o].edge == -turned(e, turn))) ++turn;
    if (turn == 4)
      refuse("Edge " + vertex_id(s[h].source) + "-" + vertex_id(s.target(h)) +
                 " does not match across its seam. Give a map that is seamless as stored.",
             ElementKind::kEdge, {s[h].source, s.target(h)});
    s[h].turn = turn;
  }
  return flat;
}

std::vector<VertexId> components(const FlatSurface& surface, std::size_t vertices) {
  DisjointSets parts(static_cast<Index>(vertices));
  for (HalfedgeId h = 0; h < surface.halfedges(); ++h)
    parts.join(surface[h].source, surface.target(h));
  return parts.firsts();
}

std::vector<Index> quarters_around(const FlatSurface& surface, std::size_t vertices) {
  std::vector<double> angle(vertices, 0.0);
  for (HalfedgeId h = 0; h < surface.halfedges(); ++h) {
    const Gauss a = surface[h].edge, b = -surface[previous_corner(h)].edge;
    angle[at(surface[h].source)] +=
        std::atan2(static_cast<double>(cross(a, b)), static_cast<double>(dot(a, b)));
  }
  std::vector<Index> quarters;
  for (const double sum : angle)
    quarters.push_back(static_cast<Index>(std::lround(sum / kQuarterTurn)));
  return quarters;
}

Diamond diamond(const FlatSurface& surface, HalfedgeId h, Gauss Side::*of) {
  const HalfedgeId o = surface[h].opposite;
  Diamond d;
  d.before = surface[previous_corner(h)].*of;
  d.diagonal = d.before + turned(surface[next_corner(o)].*of, surface[o].turn);
  d.across = d.before + surface[h].*of;
  return d;
}

}  // namespace flipfree::quads
