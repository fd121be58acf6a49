#include "flipfree/matchmaker/relax.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/matchmaker/request.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// A neighbourhood with a larger share of the map's vertices is the map.
constexpr double kMostNeighbourhoodShare = 0.5;
// Vertices move within so many rings around added ones.
constexpr int kRingsAroundAdded = 6;
// A refined map is optimised for so many Newton steps times vertices, but this many steps at least.
constexpr double kRefinedWork = 4e6;
constexpr int kFewestSteps = 10;

bool minimize(const mesh::Surface& surface, const distortion::MinimizeOptions& options, Points2& uv,
              ExecutionContext& context) {
  if (static_cast<Eigen::Index>(options.fixed.size()) >= uv.rows()) return true;
  Outcome<distortion::Minimized> better = attempt([&] {
    return distortion::with_own_map(
        [&] { return distortion::minimize_distortion(surface, uv, options, context); });
  });
  if (better) uv = std::move(better->uv);
  return static_cast<bool>(better);
}

distortion::MinimizeOptions minimize_options(int steps, std::vector<VertexId> fixed = {}) {
  distortion::MinimizeOptions options;
  options.max_iterations = steps;
  options.fixed = std::move(fixed);
  options.lengthen = true;
  return options;
}

}  // namespace

std::vector<char> flags_of(const std::vector<VertexId>& vertices, std::size_t count) {
  std::vector<char> flags(count, 0);
  for (const VertexId v : vertices) flags[at(v)] = 1;
  return flags;
}

std::vector<VertexId> vertices_near(const Mesh& mesh, std::vector<VertexId> seeds, int rings) {
  sort_unique(seeds);
  std::vector<VertexId> near = seeds;
  std::vector<VertexId> front = std::move(seeds);
  for (int ring = 0; ring < rings && !front.empty(); ++ring) {
    std::vector<VertexId> next;
    for (const VertexId v : front) {
      mesh.for_each_outgoing(v, [&](HalfedgeId h) {
        next.push_back(mesh.target(h));
        next.push_back(mesh.apex(h));
      });
    }
    sort_unique(next);
    front.clear();
    std::ranges::set_difference(next, near, std::back_inserter(front));
    std::vector<VertexId> wider;
    std::ranges::set_union(near, front, std::back_inserter(wider));
    near.swap(wider);
  }
  return near;
}

std::vector<FaceId> faces_at(const Mesh& mesh, const std::vector<VertexId>& vertices) {
  std::vector<FaceId> faces;
  for (const VertexId v : vertices)
    mesh.for_each_outgoing(v, [&](HalfedgeId h) { faces.push_back(h / 3); });
  sort_unique(faces);
  return faces;
}

Patch make_patch(const mesh::RefinedMap& map, const std::vector<Mesh::Triangle>& triangles,
                 const std::vector<VertexId>& near, const std::vector<char>& held) {
  Patch patch;
  for (const Mesh::Triangle& t : triangles)
    patch.vertices.insert(patch.vertices.end(), t.begin(), t.end());
  sort_unique(patch.vertices);
  Triangles faces = rows_of(triangles);
  for (VertexId& v : faces.reshaped()) {
    const auto found = std::lower_bound(patch.vertices.begin(), patch.vertices.end(), v);
    v = static_cast<VertexId>(found - patch.vertices.begin());
  }
  patch.surface.faces = std::move(faces);
  patch.surface.vertices.resize(static_cast<Eigen::Index>(patch.vertices.size()), 3);
  patch.uv = map.uv(patch.vertices, Eigen::all);
  Eigen::Index row = 0;
  for (const VertexId v : patch.vertices) {
    patch.surface.vertices.row(row++) = map.surface.position[at(v)].transpose();
    const bool moves = held[at(v)] == 0 && std::binary_search(near.begin(), near.end(), v);
    patch.fixed.push_back(moves ? 0 : 1);
  }
  return patch;
}

bool winds_more(const mesh::RefinedMap& map, const Patch& patch, FaceId valid, const Points2& uv,
                const std::vector<FaceId>& replaced) {
  const Mesh& mesh = map.surface.mesh;
  std::map<VertexId, double> gain;  // of angle around it
  const auto add = [&](double sign, const std::array<Vector2, 3>& p, const Mesh::Triangle& vertex) {
    for (std::size_t k = 0; k < 3; ++k)
      gain[vertex[k]] += sign * turn(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
  };
  const auto places = [](const Points2& points, Index a, Index b, Index c) {
    return std::array<Vector2, 3>{points.row(a), points.row(b), points.row(c)};
  };
  for (FaceId f = 0; f < valid; ++f) {
    const auto corner = [&](Index k) { return patch.surface.faces(f, k); };
    const auto vertex = [&](Index k) { return patch.vertices[at(corner(k))]; };
    add(1.0, places(uv, corner(0), corner(1), corner(2)), {vertex(0), vertex(1), vertex(2)});
  }
  for (const FaceId f : replaced) {
    const Mesh::Triangle t = mesh.corners(f);
    add(-1.0, places(map.uv, t[0], t[1], t[2]), t);
  }
  return std::ranges::any_of(gain, [&](const auto& of) {
    return of.second >= std::numbers::pi && !mesh.is_boundary_vertex(of.first);
  });
}

bool overlaps(const mesh::RefinedMap& map, ExecutionContext& context) {
  const Grace judging(context);
  return distortion::overlaps_itself(map.surface.mesh.faces(), map.uv, context);
}

Energy measured(const mesh::RefinedMap& map, const ExecutionContext& context) {
  const mesh::Surface surface = to_surface(map.surface);
  const distortion::RestShapes rest = distortion::build_rest_shapes(surface, context);
  return {distortion::sum_energy(surface.faces, rest.triangles, map.uv, context), rest.length};
}

double best_unit(const mesh::RefinedMap& map, const ExecutionContext& context) {
  const auto [sums, length] = measured(map, context);
  const bool far = sums.worst_at_best_scale() > 10 * distortion::kProgressiveBound;
  return 1.0 / (length * (far ? std::exp(-0.5 * sums.log_area) : sums.best_scale()));
}

std::optional<distortion::TargetsResult> reach_targets(const mesh::Surface& surface,
                                                       const Points2& uv,
                                                       const VertexTargets& targets,
                                                       const distortion::MinimizeOptions& options,
                                                       ExecutionContext& context) {
  Outcome<distortion::TargetsResult> result = attempt([&] {
    return distortion::with_own_map(
        [&] { return distortion::minimize_with_targets(surface, uv, targets, options, context); });
  });
  if (!result || !result->missed.empty()) return std::nullopt;
  return std::move(*result);
}

bool relax(mesh::RefinedMap& map, const std::vector<VertexId>& fixed, int steps,
           ExecutionContext& context) {
  return minimize(to_surface(map.surface), minimize_options(steps, fixed), map.uv, context);
}

std::vector<VertexId> beside_added(const Mesh& mesh, Index keep) {
  std::vector<VertexId> vertices;
  for (VertexId v = keep; v < mesh.vertex_count(); ++v) vertices.push_back(v);
  vertices = vertices_near(mesh, std::move(vertices), 1);
  std::erase_if(vertices, [&](VertexId v) { return v >= keep; });
  return vertices;
}

bool relax_near_added(mesh::RefinedMap& map, std::vector<VertexId> seeds, Index keep,
                      const std::vector<VertexId>& fixed, int steps, ExecutionContext& context) {
  const Mesh& mesh = map.surface.mesh;
  for (VertexId v = keep; v < mesh.vertex_count(); ++v) seeds.push_back(v);
  const std::vector<VertexId> free = vertices_near(mesh, std::move(seeds), kRingsAroundAdded);
  if (static_cast<double>(free.size()) >=
      kMostNeighbourhoodShare * static_cast<double>(mesh.vertex_count()))
    return relax(map, fixed, steps, context);
  std::vector<Mesh::Triangle> triangles;
  for (const FaceId f : faces_at(mesh, free)) triangles.push_back(mesh.corners(f));
  if (triangles.empty()) return true;
  Patch patch = make_patch(map, triangles, free, flags_of(fixed, map.surface.position.size()));
  distortion::MinimizeOptions near = minimize_options(steps);
  near.unit = best_unit(map, context);
  for (std::size_t i = 0; i < patch.fixed.size(); ++i) {
    if (patch.fixed[i] != 0) near.fixed.push_back(static_cast<VertexId>(i));
  }
  if (!minimize(patch.surface, near, patch.uv, context)) return false;
  map.uv(patch.vertices, Eigen::all) = patch.uv;
  return true;
}

void optimise(mesh::RefinedMap& map, std::vector<VertexId> held, int steps, bool bijective,
              ExecutionContext& context, Stats& stats) {
  const auto count = static_cast<double>(map.surface.mesh.vertex_count());
  if (static_cast<double>(held.size()) >= count) return;
  if (count >= 3 * static_cast<double>(map.surface.input_vertices()))
    steps = std::min(steps, std::max(kFewestSteps, static_cast<int>(kRefinedWork / count)));
  distortion::MinimizeOptions options = minimize_options(steps, std::move(held));
  options.bijective = bijective;
  improve_in_time(context, stats, [&] {
    const mesh::Surface surface = to_surface(map.surface);
    distortion::Minimized better = distortion::with_own_map(
        [&] { return distortion::minimize_distortion(surface, map.uv, options, context); });
    report(better, stats);
    map.uv = std::move(better.uv);
  });
}

}  // namespace flipfree::matchmaker
