#include "flipfree/quads/prepared.h"

#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "flipfree/base/disjoint_sets.h"

namespace flipfree::quads {

Prepared prepare(FlatMap flat, const certify::Parametrization& map,
                 const ExecutionContext& context) {
  Prepared p;
  p.flat = std::move(flat);
  p.quarters = quarters_around(p.flat.surface, at(map.surface.vertices.rows()));
  std::vector<char> feature(at(p.flat.surface.halfedges()), 0);
  for (const HalfedgeId h : map.features) {
    const Gauss e = p.flat.surface.edge[at(h)];
    const HalfedgeId o = p.flat.surface.opposite[at(h)];
    if (o != kInvalid && (e.x == 0 || e.y == 0)) feature[at(h)] = feature[at(o)] = 1;
  }
  p.coarse = coarse_surface(p.flat.surface, p.quarters, std::move(feature), context);
  return p;
}

Scales scales_of(const Prepared& p, const certify::Parametrization& map) {
  const FlatSurface& flat = p.flat.surface;
  DisjointSets parts(static_cast<Index>(p.quarters.size()));
  for (HalfedgeId h = 0; h < flat.halfedges(); ++h) parts.join(flat.source[at(h)], flat.target(h));
  std::vector<Index> number(p.quarters.size(), kInvalid);
  std::vector<double> on_surface, in_map;
  Scales scales;
  const auto part = [&](VertexId v) -> std::size_t {
    Index& n = number[at(parts.find(v))];
    if (n == kInvalid) {
      n = static_cast<Index>(on_surface.size());
      on_surface.push_back(0.0);
      in_map.push_back(0.0);
    }
    return at(n);
  };
  for (FaceId f = 0; f < flat.halfedges() / 3; ++f) {
    const Vector3 a = map.surface.vertices.row(map.surface.faces(f, 0));
    const Vector3 b = map.surface.vertices.row(map.surface.faces(f, 1));
    const Vector3 c = map.surface.vertices.row(map.surface.faces(f, 2));
    const double area = 0.5 * (b - a).cross(c - a).norm();
    const std::size_t n = part(flat.source[at(3 * f)]);
    on_surface[n] += area;
    in_map[n] += 0.5 * static_cast<double>(flat.twice_area(f));
    scales.area += area;
  }
  for (std::size_t n = 0; n < in_map.size(); ++n)
    scales.scale.push_back(std::sqrt(on_surface[n] / scales.area / in_map[n]));
  for (FaceId f = 0; f < p.coarse.faces(); ++f)
    scales.component.push_back(static_cast<Index>(part(p.coarse.flat.source[at(3 * f)])));
  return scales;
}

}  // namespace flipfree::quads
