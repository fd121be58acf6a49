#include "flipfree/quads/prepared.h"

#include <algorithm>
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
    const Gauss e = p.flat.surface[h].edge;
    const HalfedgeId o = p.flat.surface[h].opposite;
    if (o == kInvalid || (e.x != 0 && e.y != 0)) continue;
    feature[at(h)] = feature[at(o)] = 1;
    p.features.insert(p.features.end(), {h, o});
  }
  p.coarse = coarse_surface(p.flat.surface, p.quarters, std::move(feature), context);
  return p;
}

Scales scales_of(const Prepared& p, const certify::Parametrization& map) {
  const FlatSurface& flat = p.flat.surface;
  DisjointSets parts(static_cast<Index>(p.quarters.size()));
  for (HalfedgeId h = 0; h < flat.halfedges(); ++h) parts.join(flat[h].source, flat.target(h));
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
    const std::size_t n = part(flat[3 * f].source);
    on_surface[n] += area;
    in_map[n] += 0.5 * static_cast<double>(flat.twice_area(f));
    scales.area += area;
  }
  for (std::size_t n = 0; n < in_map.size(); ++n)
    scales.scale.push_back(std::sqrt(on_surface[n] / scales.area / in_map[n]));
  for (FaceId f = 0; f < p.coarse.faces(); ++f)
    scales.component.push_back(static_cast<Index>(part(p.coarse[3 * f].source)));
  return scales;
}

namespace {

// The map's half-edges along a feature's edge of the coarse surface.
std::vector<HalfedgeId> pieces_of(const Prepared& p, const std::vector<char>& feature,
                                  const std::vector<HalfedgeId>& kept, HalfedgeId edge) {
  const FlatSurface& flat = p.flat.surface;
  std::vector<HalfedgeId> pieces;
  HalfedgeId next = p.coarse[edge].start;
  while (next != kInvalid && feature[at(next)] != 0) {
    pieces.push_back(next);
    const HalfedgeId back = flat[next].opposite;
    if (kept[at(flat[back].source)] != kInvalid) break;
    next = kInvalid;
    around(flat, back, [&](HalfedgeId h) {
      if (h != back && feature[at(h)] != 0) next = h;
      return next == kInvalid;
    });
  }
  return pieces;
}

}  // namespace

std::vector<HalfedgeId> close_features(const Prepared& p, const Scales& scales, double wanted) {
  constexpr double kClose = 0.1;
  const FlatSurface& coarse = p.coarse;
  // Sides that face the end of another feature that runs the same way, from there.
  struct Facing {
    double length;
    HalfedgeId edge, beside;
  };
  std::vector<Facing> sides;
  for (HalfedgeId h = 0; h < coarse.halfedges(); ++h) {
    if (p.coarse[h].feature == 0) continue;
    const double scale = scales.scale[at(scales.component[at(h / 3)])] * std::sqrt(wanted);
    const double length = as_vector(coarse[h].edge).norm();
    const auto height = static_cast<double>(coarse.twice_area(h / 3)) / length;
    if (!(scale * height < kClose)) continue;
    const HalfedgeId apex = previous_corner(h);
    Index turn = 0;
    HalfedgeId beside = kInvalid;
    around(coarse, apex, [&](HalfedgeId e) {
      const Gauss there = turned(coarse[e].edge, -turn);
      if (p.coarse[e].feature != 0 && cross(there, coarse[h].edge) == 0) beside = e;
      turn += coarse[previous_corner(e)].turn;
      return beside == kInvalid;
    });
    if (beside != kInvalid) sides.push_back({scale * length, h, beside});
  }
  std::sort(sides.begin(), sides.end(), [](const Facing& a, const Facing& b) {
    return std::pair(a.length, a.edge) < std::pair(b.length, b.edge);
  });
  std::vector<char> feature(at(p.flat.surface.halfedges()), 0), gone(at(coarse.halfedges()), 0);
  for (const HalfedgeId h : p.features) feature[at(h)] = 1;
  const std::vector<HalfedgeId> kept = leaving(coarse, p.quarters.size());
  std::vector<HalfedgeId> close;
  for (const Facing& side : sides) {
    if (gone[at(side.edge)] != 0 || gone[at(side.beside)] != 0) continue;
    gone[at(side.edge)] = gone[at(coarse[side.edge].opposite)] = 1;
    for (const HalfedgeId h : pieces_of(p, feature, kept, side.edge)) {
      close.push_back(h);
      close.push_back(p.flat.surface[h].opposite);
    }
  }
  return close;
}

}  // namespace flipfree::quads
