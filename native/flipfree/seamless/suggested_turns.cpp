#include "flipfree/seamless/suggested_turns.h"

#include <algorithm>
#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/stats.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/bordered/corners.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {
namespace {

// A torus has no metric with the cones 3 and 5, but one without cones.
bool is_empty_stratum(const std::vector<Index>& turns) {
  std::vector<Index> cones;
  std::copy_if(turns.begin(), turns.end(), std::back_inserter(cones),
               [](Index k) { return k != 4; });
  std::sort(cones.begin(), cones.end());
  return cones == std::vector<Index>{3, 5};
}

}  // namespace

std::vector<Index> suggested_turns(const mesh::Surface& surface,
                                   const conformal::SuggestConesOptions& options,
                                   ExecutionContext& context) {
  check_surface(surface, context);
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, surface.faces);
  const mesh::CutMesh whole =
      mesh::cut_along(surface.faces, adjacency, mesh::EdgeFlags(adjacency.opposite.size(), 0));
  const std::vector<mesh::Chart> parts = mesh::split_into_charts(surface.vertices, whole);
  conformal::SuggestConesOptions own = options;
  own.quantum = kQuarterTurn;
  const Stopwatch watch;
  std::vector<Index> turns(at(vertex_count), 4);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double count = static_cast<double>(parts.size());
    const ProgressRange range(context, static_cast<double>(i) / count,
                              static_cast<double>(i + 1) / count);
    std::vector<VertexId> vertices;
    for (const VertexId v : parts[i].vertices) vertices.push_back(whole.vertex_origin[at(v)]);
    constexpr double kLeastSeconds = 1e-3;
    if (options.enough_seconds > 0.0)  // what a part leaves is the next ones'
      own.enough_seconds = std::max(kLeastSeconds, options.enough_seconds - watch.seconds());
    conformal::SuggestedCones found;
    try {
      found = conformal::suggest_cones(mesh::InOwnUnit(parts[i].surface).surface(), own, context);
    } catch (...) {
      rethrow_placed(parts[i].faces, vertices);
    }
    const auto count_of_part = static_cast<Index>(parts[i].surface.vertices.rows());
    const mesh::Adjacency around = mesh::build_adjacency(count_of_part, parts[i].surface.faces);
    std::vector<Index> own_turns(found.target_angles.size());
    std::transform(found.target_angles.begin(), found.target_angles.end(), own_turns.begin(),
                   [](double a) { return static_cast<Index>(std::lround(a / kQuarterTurn)); });
    for (const auto& loop : mesh::boundary_loops(parts[i].surface.faces, around)) {
      for (const VertexId v : loop) own_turns[at(v)] = kNotGiven;
    }
    if (is_empty_stratum(own_turns)) continue;
    for (std::size_t v = 0; v < own_turns.size(); ++v) turns[at(vertices[v])] = own_turns[v];
  }
  return turns;
}

}  // namespace flipfree::seamless
