#include "flipfree/unwrap/islands/islands.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/islands/corners.h"
#include "flipfree/unwrap/islands/scale_field.h"

namespace flipfree::unwrap {
namespace {

class Cutter {
 public:
  Cutter(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
         const mesh::EdgeFlags& uncuttable, ExecutionContext& context)
      : surface_(surface), uncuttable_(uncuttable), context_(context) {
    islands_.cut = seams;
    islands_.added.assign(seams.size(), 0);
    opened_.assign(static_cast<std::size_t>(surface.faces.rows()), 0);
  }

  // Rebuilds the charts and cuts each along what `find(chart, adjacency, uncuttable)` flags of its
  // edges; charts for which `wanted` is false stay. True if anything was cut.
  template <typename Find, typename Wanted>
  bool cut_charts(const mesh::Adjacency& adjacency, Find find, Wanted wanted) {
    islands_.mesh = mesh::cut_along(surface_.faces, adjacency, islands_.cut);
    islands_.charts = mesh::split_into_charts(surface_.vertices, islands_.mesh);
    bool any = false;
    for (const mesh::Chart& chart : islands_.charts) {
      context_.check();
      if (!wanted(chart)) continue;
      const mesh::EdgeFlags graph =
          find(chart, adjacency_of(chart.surface), part_of(chart, uncuttable_));
      if (!any_flag(graph)) continue;
      for (std::size_t h = 0; h < graph.size(); ++h) {
        if (graph[h]) islands_.cut[corner_of(chart, h)] = islands_.added[corner_of(chart, h)] = 1;
      }
      any = true;
      for (const FaceId f : chart.faces) opened_[static_cast<std::size_t>(f)] = 1;
    }
    return any;
  }

  bool opened(const mesh::Chart& chart) const {
    return opened_[static_cast<std::size_t>(chart.faces.front())] != 0;
  }

  Islands& islands() { return islands_; }

 private:
  const mesh::Surface& surface_;
  const mesh::EdgeFlags& uncuttable_;
  ExecutionContext& context_;
  Islands islands_;
  std::vector<char> opened_;  // faces of charts that were cut
};

bool is_sphere(const mesh::Surface& piece, const mesh::Adjacency& adjacency) {
  const mesh::Topology shape = mesh::topology(piece.faces, adjacency);
  return shape.boundary_loops == 0 && shape.genus() == 0;
}

}  // namespace

Islands make_islands(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                     const mesh::EdgeFlags& seams, const mesh::EdgeFlags& uncuttable,
                     bool extremities, ExecutionContext& context, const Opening& opening) {
  Cutter cutter(surface, seams, uncuttable, context);
  const auto open_up = [&](const mesh::Chart& chart, const mesh::Adjacency& local,
                           const mesh::EdgeFlags& avoid) {
    if (!opening.spheres && is_sphere(chart.surface, local))
      return mesh::EdgeFlags(local.opposite.size(), 0);
    std::vector<char> avoided;
    const std::vector<VertexId>& origin = cutter.islands().mesh.vertex_origin;
    for (std::size_t i = 0; i < chart.vertices.size() && !opening.pinned.empty(); ++i) {
      const VertexId v = origin[static_cast<std::size_t>(chart.vertices[i])];
      avoided.push_back(opening.pinned[static_cast<std::size_t>(v)]);
    }
    return mesh::planar_cut(chart.surface, local, context, avoid, avoided,
                            part_of(chart, opening.cost));
  };
  const auto slit = [&](const mesh::Chart& chart, const mesh::Adjacency& local,
                        const mesh::EdgeFlags& avoid) {
    return cut_to_extremities(chart.surface, local, avoid, context);
  };
  // One round opens every piece; seams around a handle can leave a part that needs another. Each
  // round lowers the genus or opens a closed piece.
  constexpr int kMostRounds = 64;
  bool planar = false;
  for (int round = 0; round < kMostRounds && !planar; ++round) {
    planar = !cutter.cut_charts(adjacency, open_up, [](const mesh::Chart&) { return true; });
    if (round > 0) continue;
    for (const mesh::Chart& chart : cutter.islands().charts)
      cutter.islands().opened += cutter.opened(chart);
  }
  if (!planar) throw InternalError("a chart could not be cut open; please report this mesh");
  const auto was_opened = [&](const mesh::Chart& chart) { return cutter.opened(chart); };
  if (extremities && cutter.islands().opened > 0 &&
      cutter.cut_charts(adjacency, slit, was_opened)) {
    cutter.islands().mesh = mesh::cut_along(surface.faces, adjacency, cutter.islands().cut);
    cutter.islands().charts = mesh::split_into_charts(surface.vertices, cutter.islands().mesh);
  }
  return std::move(cutter.islands());
}

void cut_further(Islands& islands, const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                 const mesh::EdgeFlags& further) {
  for (std::size_t h = 0; h < further.size(); ++h) {
    if (further[h] && !islands.cut[h]) islands.cut[h] = islands.added[h] = 1;
  }
  islands.mesh = mesh::cut_along(surface.faces, adjacency, islands.cut);
  islands.charts = mesh::split_into_charts(surface.vertices, islands.mesh);
}

Points3 normalised(const Points3& positions, const Triangles& faces) {
  const auto count = static_cast<std::size_t>(positions.rows());
  DisjointSets components(static_cast<Index>(count));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    components.join(faces(f, 0), faces(f, 1));
    components.join(faces(f, 1), faces(f, 2));
  }
  const Vector3 infinite = Vector3::Constant(std::numeric_limits<double>::infinity());
  std::vector<Vector3> low(count, infinite);
  std::vector<Vector3> high(count, -infinite);
  for (const VertexId v : faces.reshaped()) {
    const auto c = static_cast<std::size_t>(components.find(v));
    low[c] = low[c].cwiseMin(positions.row(v).transpose());
    high[c] = high[c].cwiseMax(positions.row(v).transpose());
  }
  double size = 0.0;
  for (std::size_t c = 0; c < count; ++c) {
    // Halves first: the difference of two huge coordinates may not be finite.
    if (low[c].x() <= high[c].x()) size = std::max(size, (0.5 * high[c] - 0.5 * low[c]).maxCoeff());
  }
  int exponent = 0;
  std::frexp(size, &exponent);
  Points3 result = positions;
  for (VertexId v = 0; v < static_cast<VertexId>(count); ++v) {
    const auto c = static_cast<std::size_t>(components.find(v));
    if (low[c].x() <= high[c].x()) result.row(v) -= (0.5 * low[c] + 0.5 * high[c]).transpose();
  }
  for (double& x : result.reshaped()) x = std::ldexp(x, -exponent);
  return result;
}

}  // namespace flipfree::unwrap
