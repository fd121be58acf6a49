#include "flipfree/unwrap/islands/islands.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph.h"

namespace flipfree::unwrap {
namespace {

bool is_sphere(const mesh::Surface& piece) {
  const mesh::Topology shape = mesh::topology(piece.faces, piece.adjacency());
  return shape.boundary_loops == 0 && shape.genus() == 0;
}

}  // namespace

Islands make_islands(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
                     const mesh::EdgeFlags& uncuttable, ExecutionContext& context,
                     const Opening& opening) {
  Islands islands{seams, mesh::EdgeFlags(seams.size(), 0), {}, {}};
  // Opens every chart that is closed or has handles. Returns how many.
  const auto open_up = [&] {
    mesh::EdgeFlags further(seams.size(), 0);
    Index count = 0;
    for (const mesh::Chart& chart : islands.charts) {
      context.check();
      if (!opening.spheres && is_sphere(chart.surface)) continue;
      std::vector<char> avoided;
      for (std::size_t i = 0; i < chart.vertices.size() && !opening.pinned.empty(); ++i)
        avoided.push_back(opening.pinned[at(islands.mesh.vertex_origin[at(chart.vertices[i])])]);
      const mesh::EdgeFlags own =
          mesh::planar_cut(chart.surface, chart.surface.adjacency(), context,
                           part_of(chart, uncuttable), avoided, part_of(chart, opening.cost));
      if (any_flag(own)) ++count;
      put_part(chart, own, further);
    }
    if (count > 0) cut_further(islands, surface, further);
    return count;
  };
  cut_further(islands, surface, {});
  // One round opens every piece; seams around a handle can leave a part that needs another. Each
  // round lowers the genus or opens a closed piece.
  constexpr int kMostRounds = 64;
  islands.opened = open_up();
  Index last = islands.opened;
  for (int round = 1; round < kMostRounds && last > 0; ++round) last = open_up();
  if (last > 0) throw InternalError("a chart could not be cut open; please report this mesh");
  return islands;
}

void cut_further(Islands& islands, const mesh::Surface& surface, const mesh::EdgeFlags& further) {
  for (std::size_t h = 0; h < further.size(); ++h) {
    if (further[h] && !islands.cut[h]) islands.cut[h] = islands.added[h] = 1;
  }
  islands.mesh = mesh::cut_along(surface.faces, surface.adjacency(), islands.cut);
  islands.charts = mesh::split_into_charts(surface.vertices, islands.mesh);
}

std::vector<double> face_areas(const mesh::Surface& surface) {
  std::vector<double> area;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) area.push_back(face_area(surface, f));
  return area;
}

double weighted_percentile(std::vector<std::pair<double, double>> weighted, double share) {
  std::sort(weighted.begin(), weighted.end());
  double total = 0.0;
  for (const auto& [value, weight] : weighted) total += weight;
  double sum = 0.0;
  for (const auto& [value, weight] : weighted) {
    sum += weight;
    if (sum >= share * total) return value;
  }
  return weighted.empty() ? 0.0 : weighted.back().first;
}

Points3 normalised(const Points3& positions, const Triangles& faces) {
  const auto count = at(positions.rows());
  DisjointSets components(static_cast<Index>(count));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    components.join(faces(f, 0), faces(f, 1));
    components.join(faces(f, 1), faces(f, 2));
  }
  std::vector<Eigen::AlignedBox3d> boxes(count);
  for (const VertexId v : faces.reshaped())
    boxes[at(components.find(v))].extend(positions.row(v).transpose());
  // Halves first: the difference of two huge coordinates may not be finite.
  double size = 0.0;
  for (const Eigen::AlignedBox3d& box : boxes)
    if (!box.isEmpty()) size = std::max(size, (0.5 * box.max() - 0.5 * box.min()).maxCoeff());
  int exponent = 0;
  std::frexp(size, &exponent);
  Points3 result = positions;
  for (VertexId v = 0; v < static_cast<VertexId>(count); ++v) {
    const Eigen::AlignedBox3d& box = boxes[at(components.find(v))];
    if (!box.isEmpty()) result.row(v) -= (0.5 * box.min() + 0.5 * box.max()).transpose();
  }
  for (double& x : result.reshaped()) x = std::ldexp(x, -exponent);
  return result;
}

}  // namespace flipfree::unwrap
