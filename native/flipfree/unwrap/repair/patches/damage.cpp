#include "flipfree/unwrap/repair/patches/damage.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::unwrap {
namespace {

// So many times the energy of healthy faces is no shape that somebody wanted.
constexpr double kDrawnOutOverHealthy = 25.0;
// Beside a face that cannot stay, so many are enough.
constexpr double kDrawnOutBeside = 4.0;
// Energy up to which a face tells how large its chart was meant to be.
constexpr double kOrdinary = 10.0;

// Interior vertices whose faces, all positive, wind around them other than once (certify/measures:
// G2; here of some vertices only).
bool winds_once(const DamagedChart& chart, const Points2& uv, VertexId v) {
  const HalfedgeId start = chart.adjacency.vertex_halfedge[at(v)];
  if (start == kInvalid || chart.adjacency.opposite[at(start)] == kInvalid) return true;
  const auto upper = [&](VertexId p) {
    return uv(p, 1) > uv(v, 1) || (uv(p, 1) == uv(v, 1) && uv(p, 0) > uv(v, 0));
  };
  Index turns = 0;
  HalfedgeId h = start;
  do {
    const bool from = upper(mesh::target(chart.surface.faces, h));
    const bool to = upper(mesh::source(chart.surface.faces, previous_corner(h)));
    if (!from && to) ++turns;
    h = mesh::rotate_ccw(chart.adjacency, h);
  } while (h != start);
  return turns == 1;
}

}  // namespace

double weighted_median(std::vector<std::pair<double, double>> weighted) {
  std::sort(weighted.begin(), weighted.end());
  double total = 0.0;
  for (const auto& [value, weight] : weighted) total += weight;
  double sum = 0.0;
  for (const auto& [value, weight] : weighted) {
    sum += weight;
    if (2.0 * sum >= total) return value;
  }
  return 0.0;
}

std::vector<double> face_areas(const mesh::Surface& surface) {
  std::vector<double> area(at(static_cast<Index>(surface.faces.rows())));
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const Vector3 p = surface.vertices.row(surface.faces(f, 0));
    const Vector3 e1 = surface.vertices.row(surface.faces(f, 1)).transpose() - p;
    const Vector3 e2 = surface.vertices.row(surface.faces(f, 2)).transpose() - p;
    area[at(f)] = 0.5 * e1.cross(e2).norm();
  }
  return area;
}

std::vector<char> stacked_vertices(const Points2& uv) {
  std::vector<VertexId> order(at(static_cast<Index>(uv.rows())));
  std::iota(order.begin(), order.end(), 0);
  const auto place = [&](VertexId v) { return std::pair(uv(v, 0), uv(v, 1)); };
  std::sort(order.begin(), order.end(),
            [&](VertexId a, VertexId b) { return place(a) < place(b); });
  std::vector<char> stacked(order.size(), 0);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (place(order[i]) == place(order[i - 1]))
      stacked[at(order[i])] = stacked[at(order[i - 1])] = 1;
  }
  return stacked;
}

Density density_of(const mesh::Surface& surface, const std::vector<double>& areas,
                   const Points2& uv, const std::vector<char>& unknown) {
  std::vector<char> stacked = stacked_vertices(uv);
  for (std::size_t v = 0; v < unknown.size(); ++v) stacked[v] |= unknown[v];
  const auto usable = [&](FaceId f) {
    const auto corners = surface.faces.row(f);
    return std::none_of(corners.begin(), corners.end(),
                        [&](VertexId v) { return stacked[at(v)] != 0; });
  };
  std::vector<std::pair<double, double>> ratios;
  double total = 0.0;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const auto corner = [&](Index k) -> Vector2 { return uv.row(surface.faces(f, k)).transpose(); };
    const double area = areas[at(f)];
    total += area;
    const double ratio = 0.5 * twice_area(corner(0), corner(1), corner(2)) / area;
    if (ratio > 0.0 && std::isfinite(ratio) && usable(f)) ratios.emplace_back(ratio, area);
  }
  const double value = std::sqrt(weighted_median(std::move(ratios)));
  if (!std::isnormal(value) || !(total > 0.0)) return {};
  const std::vector<double> energies = face_energies(surface, uv, value);
  double healthy = 0.0;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (energies[at(f)] <= kOrdinary && usable(f)) healthy += areas[at(f)];
  }
  return {value, healthy / total};
}

double median_density(const mesh::Surface& surface, const Points2& uv) {
  const mesh::InOwnUnit own(surface);
  return density_of(own.surface(), face_areas(own.surface()), uv).value / own.unit();
}

std::vector<double> face_energies(const mesh::Surface& surface, const Points2& uv, double density) {
  const Triangles& faces = surface.faces;
  const Points3 parts = certify::symmetric_dirichlet_parts(surface, by_corner(faces, uv));
  const double s2 = density * density;
  std::vector<double> energies(at(static_cast<Index>(faces.rows())));
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const double e = 0.25 * (parts(f, 0) / s2 + parts(f, 1) * s2);
    energies[at(f)] = std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
  }
  return energies;
}

Healthy healthy_energy(const std::vector<double>& area, const std::vector<double>& energies) {
  std::vector<std::pair<double, double>> finite;
  for (std::size_t f = 0; f < area.size(); ++f) {
    if (std::isfinite(energies[f])) finite.emplace_back(energies[f], area[f]);
  }
  Healthy healthy;
  healthy.median = std::max(1.0, weighted_median(finite));
  double sum = 0.0;
  double weight = 0.0;
  for (const auto& [energy, a] : finite) {
    if (energy > kDrawnOutOverHealthy * healthy.median) continue;
    sum += a * energy;
    weight += a;
  }
  if (weight > 0.0) healthy.mean = std::max(1.0, sum / weight);
  return healthy;
}

Damage find_damage(const DamagedChart& chart, const Points2& uv,
                   const std::vector<double>& energies, const Healthy& healthy, bool spoilt,
                   const ExecutionContext& context) {
  const Triangles& faces = chart.surface.faces;
  Damage damage;
  damage.bad.assign(at(static_cast<Index>(faces.rows())), 0);
  std::vector<char> touched(chart.unknown.size(), 0);  // vertices of faces that are not positive
  std::vector<FaceId> front;
  const auto add = [&](FaceId f) {
    if (damage.bad[at(f)] != 0) return;
    damage.bad[at(f)] = 1;
    ++damage.count;
    front.push_back(f);
  };
  for (const FaceId f : distortion::flipped_faces(faces, uv, context)) {
    for (Index k = 0; k < 3; ++k) touched[at(faces(f, k))] = 1;
    add(f);
  }
  for (FaceId f = 0; f < faces.rows(); ++f) {
    if (spoilt && energies[at(f)] > kDrawnOutOverHealthy * healthy.median) add(f);
    for (Index k = 0; k < 3; ++k) {
      if (chart.unknown[at(faces(f, k))] != 0) add(f);
    }
  }
  const auto around = [&](VertexId v, auto visit) {
    const HalfedgeId start = chart.adjacency.vertex_halfedge[at(v)];
    for (HalfedgeId h = start; h != kInvalid;) {
      visit(h / 3);
      h = mesh::rotate_ccw(chart.adjacency, h);
      if (h == start) break;
    }
  };
  for (VertexId v = 0; v < static_cast<VertexId>(touched.size()); ++v) {
    if (touched[at(v)] == 0 && !winds_once(chart, uv, v)) around(v, add);
  }
  std::vector<char> looked_around(touched.size(), 0);
  while (!front.empty()) {
    const FaceId f = front.back();
    front.pop_back();
    for (Index k = 0; k < 3; ++k) {
      if (std::exchange(looked_around[at(faces(f, k))], 1) != 0) continue;
      around(faces(f, k), [&](FaceId g) {
        if (energies[at(g)] > kDrawnOutBeside * healthy.median) add(g);
      });
    }
  }
  return damage;
}

}  // namespace flipfree::unwrap
