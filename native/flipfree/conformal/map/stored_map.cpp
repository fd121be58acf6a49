#include "flipfree/conformal/map/stored_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/base/failure/outcome.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/mesh/cut_graph/cut.h"

namespace flipfree::conformal {
void take_map(intrinsic::MetricLayout& layout, certify::Parametrization& map) {
  intrinsic::RefinedLayout& refined = layout.map;
  map.cut_edges = std::move(layout.cut_edges);
  map.surface = std::move(refined.surface);
  map.uv = std::move(refined.uv);
  map.uv32 = map.uv.cast<float>();
  map.parent_face = std::move(refined.provenance.face);
  const std::vector<mesh::SurfacePoint>& where = refined.provenance.vertex;
  map.vertex_parent.resize(where.size());
  map.vertex_barycentric.resize(static_cast<Eigen::Index>(where.size()), 3);
  for (std::size_t v = 0; v < where.size(); ++v) {
    map.vertex_parent[v] = where[v].face;
    map.vertex_barycentric.row(static_cast<Eigen::Index>(v)) = where[v].weight;
  }
}

bool repair_rounding(certify::Parametrization& map, ExecutionContext& context) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const mesh::CutMesh cut =
      mesh::cut_along(map.surface.faces, adjacency, mesh::uv_cuts(adjacency, map.uv));
  Points2 uv(static_cast<Eigen::Index>(cut.vertex_origin.size()), 2);
  for (Index c = 0; c < static_cast<Index>(map.uv.rows()); ++c) {
    uv.row(cut.faces(c / 3, c % 3)) = map.uv.row(c);
  }
  const Outcome<Points2f> stored =
      attempt([&] { return distortion::round_to_storage(cut.faces, uv, {}, context, map.stats); });
  if (!stored) return false;
  for (Index c = 0; c < static_cast<Index>(map.uv32.rows()); ++c)
    map.uv32.row(c) = (*stored).row(cut.faces(c / 3, c % 3));
  return true;
}

double stored_angle_error(const certify::Parametrization& map,
                          const std::vector<std::pair<VertexId, double>>& prescribed) {
  std::vector<double> sum(static_cast<std::size_t>(map.surface.vertices.rows()), 0.0);
  std::vector<char> asked(sum.size(), 0);
  for (const auto& [v, angle] : prescribed) asked[at(v)] = 1;
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv32.rows()); ++c) {
    if (asked[at(map.surface.faces(c / 3, c % 3))] == 0) continue;
    const Vector2 p = map.uv32.row(c).cast<double>();
    const Vector2 a = map.uv32.row(next_corner(c)).cast<double>().transpose() - p;
    const Vector2 b = map.uv32.row(previous_corner(c)).cast<double>().transpose() - p;
    sum[at(map.surface.faces(c / 3, c % 3))] += turn(a, b);
  }
  double largest = 0.0;
  for (const auto& [v, angle] : prescribed)
    largest = std::max(largest, std::abs(sum[at(v)] - angle));
  return largest;
}

}  // namespace flipfree::conformal
