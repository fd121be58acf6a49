#include "flipfree/seamless/padding/disks/cut_disks.h"

#include <utility>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/disks/disk_metric.h"
#include "flipfree/seamless/padding/open_cut.h"

namespace flipfree::seamless {

std::vector<CutDisk> solve_disks(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                                 const CutSegments& segments, const std::vector<Index>& cones,
                                 ExecutionContext& context) {
  const OpenCut open = open_cut(cut, adjacency, segments, cones);
  std::vector<mesh::Chart> charts = mesh::split_into_charts(cut.surface.vertices, open.mesh);
  std::vector<CutDisk> disks(charts.size());
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const auto count = static_cast<double>(charts.size());
    const ProgressRange range(context, static_cast<double>(i) / count,
                              static_cast<double>(i + 1) / count);
    std::vector<double> own;
    for (const VertexId v : charts[i].vertices) own.push_back(open.angle[at(v)]);
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
