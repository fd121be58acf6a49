#include "flipfree/unwrap/seams/slits/slits.h"

#include "flipfree/unwrap/seams/slits/carried_slits.h"

namespace flipfree::unwrap {
namespace {

// Triangles of a chart above which few of its vertices are searched instead.
constexpr Eigen::Index kLarge = 24000;

}  // namespace

Slits find_slits(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                 const std::vector<double>& cost, const SlitOptions& options,
                 ExecutionContext& context) {
  if (chart.faces.rows() > kLarge) {
    Slits slits = carried_slits(chart, adjacency, cost, options, context);
    if (!slits.cut.empty()) return slits;
  }
  const Mirror mirror = find_mirror(chart, adjacency, cost);
  const std::vector<double> own = mirror.empty() ? cost : mirrored_costs(chart.faces, mirror, cost);
  Slits slits = SlitSearch(chart, adjacency, own, mirror, options, context).run(options.bound);
  slits.symmetric = !mirror.empty();
  return slits;
}

}  // namespace flipfree::unwrap
