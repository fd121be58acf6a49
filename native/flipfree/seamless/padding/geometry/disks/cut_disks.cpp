#include "flipfree/seamless/padding/geometry/disks/cut_disks.h"

#include <numbers>
#include <utility>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/geometry/disks/disk_metric.h"

namespace flipfree::seamless {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

}  // namespace

std::vector<CutDisk> solve_disks(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                                 const CutSegments& segments, const std::vector<Index>& cones,
                                 ExecutionContext& context) {
  mesh::EdgeFlags flags(adjacency.opposite.size(), 0);
  for (const auto& branch : cut.branches) {
    for (const HalfedgeId h : branch) flags[at(h)] = flags[at(adjacency.opposite[at(h)])] = 1;
  }
  const mesh::CutMesh open = mesh::cut_along(cut.surface.faces, adjacency, flags);
  std::vector<double> angle(open.vertex_origin.size());
  for (std::size_t v = 0; v < angle.size(); ++v)
    angle[v] = cones[at(open.vertex_origin[v])] * kQuarterTurn;
  for (std::size_t h = 0; h < flags.size(); ++h) {
    const auto c = static_cast<HalfedgeId>(h);
    if (flags[h]) angle[at(open.faces(c / 3, c % 3))] = 2.0 * kQuarterTurn;
  }
  for (const CutSegment& segment : segments.segments) {
    const HalfedgeId h = side_halfedges(cut, adjacency, segment.sides.front()).front();
    angle[at(open.faces(h / 3, h % 3))] = kQuarterTurn;
  }
  std::vector<mesh::Chart> charts = mesh::split_into_charts(cut.surface.vertices, open);
  std::vector<CutDisk> disks(charts.size());
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const auto count = static_cast<double>(charts.size());
    const ProgressRange range(context, static_cast<double>(i) / count,
                              static_cast<double>(i + 1) / count);
    std::vector<double> own;
    for (const VertexId v : charts[i].vertices) own.push_back(angle[at(v)]);
    const conformal::ConformalMetric metric = compute_disk_metric(charts[i].surface, own, context);
    const mesh::Adjacency of_chart =
        mesh::build_adjacency(static_cast<Index>(own.size()), charts[i].surface.faces);
    disks[i].half = halve(metric, of_chart, context);
    disks[i].chart = std::move(charts[i]);
    disks[i].iterations = metric.iterations;
    disks[i].bits = metric.bits;
    disks[i].scale_range = metric.scale_range;
  }
  return disks;
}

}  // namespace flipfree::seamless
