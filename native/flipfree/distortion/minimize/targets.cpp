#include "flipfree/distortion/minimize/targets.h"

#include <algorithm>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/distortion/minimize/minimizer.h"

namespace flipfree::distortion {

TargetsResult minimize_with_targets(const mesh::Surface& chart, const Points2& initial_uv,
                                    const std::vector<std::pair<VertexId, Vector2>>& targets,
                                    const MinimizeOptions& options, ExecutionContext& context,
                                    Stats& stats) {
  MinimizeOptions held = options;
  for (const auto& [v, target] : targets) {
    held.fixed.push_back(v);
    if (!target.allFinite()) {
      throw_invalid(ErrorCode::kBadPins,
                    "The target of vertex " + std::to_string(v) + " is not finite. Correct it.",
                    ElementKind::kVertex, {v});
    }
  }
  std::sort(held.fixed.begin(), held.fixed.end());
  const auto twice = std::adjacent_find(held.fixed.begin(), held.fixed.end());
  if (twice != held.fixed.end()) {
    throw_invalid(ErrorCode::kBadPins,
                  "Vertex " + std::to_string(*twice) + " is pinned twice. Give it one place.",
                  ElementKind::kVertex, {*twice});
  }
  check_start(chart, initial_uv, held, context);
  Minimizer minimizer(chart.faces, build_rest_shapes(chart, context), &chart, initial_uv, held,
                      context);
  TargetsResult result;
  {
    const ProgressRange range(context, 0.0, 0.5);
    result.fraction = minimizer.pull(targets);
  }
  const ProgressRange range(context, 0.5, 1.0);
  result.uv = minimizer.run(stats);
  for (const auto& [v, target] : targets) {
    if (result.uv.row(v) != target.transpose()) result.missed.push_back(v);
  }
  std::sort(result.missed.begin(), result.missed.end());
  stats["targets.fraction"] = result.fraction;
  return result;
}

}  // namespace flipfree::distortion
