#include "flipfree/distortion/weighted.h"

#include <utility>

#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/distortion/minimize/minimizer.h"

namespace flipfree::distortion {

Points2 minimize_weighted(const mesh::Surface& chart, const std::vector<double>& factors,
                          const Points2& initial_uv, const MinimizeOptions& options,
                          ExecutionContext& context, Stats& stats) {
  check_start(chart, initial_uv, options, context);
  RestShapes rest = build_rest_shapes(chart, context);
  double sum = 0.0;
  for (std::size_t f = 0; f < factors.size(); ++f) sum += rest.triangles[f].weight *= factors[f];
  for (RestTriangle& triangle : rest.triangles) triangle.weight /= sum;
  Minimizer minimizer(chart.faces, std::move(rest), &chart, initial_uv, options, context);
  return minimizer.run(stats);
}

}  // namespace flipfree::distortion
