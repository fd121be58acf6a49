#include "flipfree/unwrap/pack.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certify.h"
#include "flipfree/distortion/boundary_grid.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/layout.h"

namespace flipfree {
namespace {

std::size_t size(Eigen::Index i) { return static_cast<std::size_t>(i); }

struct PackedChart {
  Points2 uv;
  Index group = 0;  // charts that turn and scale together
  bool moved = true;
  bool bijective = false;
};

double area(const Chart& chart) {
  double sum = 0.0;
  for (Eigen::Index f = 0; f < chart.surface.faces.rows(); ++f) {
    const auto at = [&](Index k) -> Vector3 {
      return chart.surface.vertices.row(chart.surface.faces(f, k)).transpose();
    };
    sum += (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
  return sum;
}

double area(const Triangles& faces, const Points2& uv) {
  double sum = 0.0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Vector2 a = (uv.row(faces(f, 1)) - uv.row(faces(f, 0))).transpose();
    const Vector2 b = (uv.row(faces(f, 2)) - uv.row(faces(f, 0))).transpose();
    sum += std::abs(cross(a, b));
  }
  return sum;
}

std::vector<PackedChart> read_charts(const std::vector<Chart>& charts, const Points2& corner_uv,
                                     const Components& components, const PackOptions& options,
                                     const ExecutionContext& context) {
  std::vector<char> unmoved(size(corner_uv.rows()), 0);
  for (const CornerId c : options.unmoved) {
    if (c < 0 || c >= corner_uv.rows()) {
      throw_invalid(ErrorCode::kIndexOutOfRange,
                    "Corner " + std::to_string(c) + " that shall stay does not exist.");
    }
    unmoved[size(c)] = 1;
  }
  std::vector<PackedChart> result(charts.size());
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const Triangles& faces = charts[c].surface.faces;
    PackedChart& chart = result[c];
    chart.uv.resize(charts[c].surface.vertices.rows(), 2);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) {
        const CornerId corner = 3 * charts[c].faces[size(f)] + k;
        chart.uv.row(faces(f, k)) = corner_uv.row(corner);
        if (unmoved[size(corner)] != 0) chart.moved = false;
      }
    }
    chart.group = options.together ? components.of_face[size(charts[c].faces.front())]
                                   : static_cast<Index>(c);
    chart.bijective = options.keep_bijective &&
                      !distortion::overlaps_itself(
                          distortion::find_boundary(static_cast<Index>(chart.uv.rows()), faces),
                          chart.uv, context);
  }
  return result;
}

// Turns and scales the charts of each group: by the smallest rectangle of its largest chart.
void align_groups(const std::vector<Chart>& charts, const PackOptions& options,
                  std::vector<PackedChart>& packed) {
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t c = 0; c < packed.size(); ++c) {
    if (!packed[c].moved) continue;
    groups.resize(std::max(groups.size(), size(packed[c].group) + 1));
    groups[size(packed[c].group)].push_back(c);
  }
  for (const std::vector<std::size_t>& members : groups) {
    if (members.empty()) continue;
    double surface_area = 0.0;
    double uv_area = 0.0;
    std::size_t largest = members.front();
    double largest_area = -1.0;
    for (const std::size_t c : members) {
      const double own = area(charts[c].surface.faces, packed[c].uv);
      if (own > largest_area) largest = c;
      largest_area = std::max(largest_area, own);
      uv_area += own;
      surface_area += area(charts[c]);
    }
    const double ratio = std::sqrt(surface_area / uv_area);
    const double scale = options.scale_true && std::isnormal(ratio) ? ratio : 1.0;
    // The turn that turn_to_smallest_rectangle gives the largest chart, fitted to its points.
    Points2 turned = packed[largest].uv;
    turn_to_smallest_rectangle(turned);
    const Similarity fitted = fit_similarity(packed[largest].uv, turned);
    const Vector2 turn = scale * fitted.linear.normalized();
    for (const std::size_t c : members) {
      Points2& uv = packed[c].uv;
      for (Eigen::Index v = 0; v < uv.rows(); ++v) {
        const Vector2 p = uv.row(v).transpose();
        uv.row(v) << turn.x() * p.x() - turn.y() * p.y(), turn.y() * p.x() + turn.x() * p.y();
      }
      uv.rowwise() -= uv.colwise().minCoeff().eval();
    }
  }
}

void place(const PackOptions& options, std::vector<PackedChart>& packed) {
  std::vector<std::size_t> moved;
  std::vector<Vector2> sizes;
  for (std::size_t c = 0; c < packed.size(); ++c) {
    if (!packed[c].moved) continue;
    moved.push_back(c);
    sizes.emplace_back(packed[c].uv.colwise().maxCoeff().transpose());
  }
  const Placement placement = pack_rectangles(sizes, options.margin);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    Points2& uv = packed[moved[i]].uv;
    uv = ((uv.rowwise() + placement.offset[i].transpose()) * placement.scale).eval();
  }
}

}  // namespace

Parametrization pack(const Surface& surface, const Points2& corner_uv, const PackOptions& options,
                     ExecutionContext& context) {
  const Stopwatch watch;
  context.report("packing", 0.0);
  require_valid_map(surface, corner_uv, context);
  const Adjacency adjacency =
      build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const EdgeFlags cuts = uv_cuts(adjacency, corner_uv);
  const std::vector<Chart> charts =
      split_into_charts(surface.vertices, cut_along(surface.faces, adjacency, cuts));
  std::vector<PackedChart> packed =
      read_charts(charts, corner_uv, face_components(adjacency), options, context);
  align_groups(charts, options, packed);
  place(options, packed);

  context.report("packing", 0.3);
  Parametrization map;
  map.surface = surface;
  map.uv.resize(corner_uv.rows(), 2);
  map.uv32.resize(corner_uv.rows(), 2);
  parallel_for(context, charts.size(), 1, [&](std::size_t c, std::size_t, std::size_t) {
    ExecutionContext part(&context, 1);
    const Chart& chart = charts[c];
    RoundingOptions rounding;
    rounding.bijective = packed[c].bijective;
    Stats unused;
    const Points2f stored =
        round_to_storage(chart.surface.faces, packed[c].uv, rounding, part, unused);
    for (std::size_t f = 0; f < chart.faces.size(); ++f) {
      for (Index k = 0; k < 3; ++k) {
        const VertexId v = chart.surface.faces(static_cast<Eigen::Index>(f), k);
        map.uv.row(3 * chart.faces[f] + k) = packed[c].uv.row(v);
        map.uv32.row(3 * chart.faces[f] + k) = stored.row(v);
      }
    }
  });
  context.report("certifying", 0.7);
  set_identity_provenance(map);
  map.cut_edges = flagged_edges(surface.faces, adjacency, cuts);
  certify_map(map, surface, {}, context);
  require_certificate(map, "The packed map");
  map.stats["charts"] = static_cast<std::int64_t>(charts.size());
  map.stats["energy"] = map.certificate.energy;
  map.stats["seconds"] = watch.seconds();
  context.report("done", 1.0);
  return map;
}

}  // namespace flipfree
