#include "flipfree/matchmaker/smooth/relax.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "flipfree/base/failure/outcome.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/own_map.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/distortion/energy/working_rest.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/matchmaker/smooth/neighbourhood.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// A neighbourhood with a larger share of the map's vertices is the map.
constexpr double kMostNeighbourhoodShare = 0.5;

// UV length of a surface length 1 at which the map's distortion is least; while the worst
// triangles are so bad that they would decide this, at which areas are right in the mean (of their
// logarithms).
double best_unit(const mesh::RefinedMap& map, const ExecutionContext& context) {
  const mesh::Surface surface = to_surface(map.surface);
  const distortion::RestShapes rest = distortion::build_rest_shapes(surface, context);
  const distortion::EnergySums sums =
      distortion::sum_energy(surface.faces, rest.triangles, map.uv, context);
  const bool far = sums.worst_at_best_scale() > 10 * distortion::kProgressiveBound;
  return 1.0 / (rest.length * (far ? std::exp(-0.5 * sums.log_area) : sums.best_scale()));
}

bool minimize(const mesh::Surface& surface, const distortion::MinimizeOptions& options, Points2& uv,
              ExecutionContext& context) {
  if (static_cast<Eigen::Index>(options.fixed.size()) >= uv.rows()) return true;
  Stats unused;
  Outcome<Points2> better = attempt([&] {
    return distortion::with_own_map(
        [&] { return distortion::minimize_distortion(surface, uv, options, context, unused); });
  });
  if (better) uv = std::move(*better);
  return static_cast<bool>(better);
}

distortion::MinimizeOptions minimize_options(const RelaxOptions& options) {
  distortion::MinimizeOptions minimize;
  minimize.max_iterations = options.steps;
  minimize.lengthen = options.lengthen;
  minimize.memory = options.memory;
  return minimize;
}

}  // namespace

bool relax(mesh::RefinedMap& map, const std::vector<VertexId>& fixed, const RelaxOptions& options,
           ExecutionContext& context) {
  distortion::MinimizeOptions whole = minimize_options(options);
  whole.fixed = fixed;
  return minimize(to_surface(map.surface), whole, map.uv, context);
}

bool relax_near(mesh::RefinedMap& map, const std::vector<VertexId>& seeds, int rings,
                const std::vector<VertexId>& fixed, const RelaxOptions& options,
                ExecutionContext& context) {
  const mesh::EditableTriangulation& mesh = map.surface.mesh;
  const std::vector<VertexId> free = vertices_near(mesh, seeds, rings);
  if (static_cast<double>(free.size()) >=
      kMostNeighbourhoodShare * static_cast<double>(mesh.vertex_count()))
    return relax(map, fixed, options, context);
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  for (const FaceId f : faces_at(mesh, free)) triangles.push_back(mesh.corners(f));
  if (triangles.empty()) return true;
  Patch patch = make_patch(map, triangles);
  std::vector<VertexId> held = fixed;
  std::sort(held.begin(), held.end());
  distortion::MinimizeOptions near = minimize_options(options);
  near.labels = &patch.vertices;
  near.unit = best_unit(map, context);
  for (std::size_t i = 0; i < patch.vertices.size(); ++i) {
    const VertexId v = patch.vertices[i];
    if (!std::binary_search(free.begin(), free.end(), v) ||
        std::binary_search(held.begin(), held.end(), v))
      near.fixed.push_back(static_cast<VertexId>(i));
  }
  if (!minimize(patch.surface, near, patch.uv, context)) return false;
  for (std::size_t i = 0; i < patch.vertices.size(); ++i)
    map.uv.row(patch.vertices[i]) = patch.uv.row(static_cast<Eigen::Index>(i));
  return true;
}

double energy_of(const mesh::RefinedMap& map, ExecutionContext& context) {
  const mesh::Surface surface = to_surface(map.surface);
  const distortion::RestShapes rest = distortion::build_rest_shapes(surface, context);
  const distortion::EnergySums sums =
      distortion::sum_energy(surface.faces, rest.triangles, map.uv, context);
  const double energy = sums.at_best_scale();
  return std::isfinite(energy) ? energy : std::numeric_limits<double>::infinity();
}

}  // namespace flipfree::matchmaker
