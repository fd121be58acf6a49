// Least distortion subject to targets: chosen vertices are brought to given places along a
// flip-free path.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/distortion/minimize/minimize.h"

namespace flipfree::distortion {

struct TargetsResult {
  Points2 uv;           // flip-free in any case
  double fraction = 0;  // of the targets' total way; 1 exactly when all are met bit for bit
  std::vector<VertexId> missed;  // targets that were not reached, ascending
  double energy = 0;             // of uv
  int factorizations = 0;        // Newton systems that were solved on the way
};

// Moves the vertices named by `targets` from where they are in initial_uv to their targets, then
// minimises the distortion with them held there. options.fixed are held all the time. Preconditions
// and errors are those of minimize_distortion(), and every vertex has at most one target.
// Guarantee: the result is flip-free (and its boundary does not meet itself, with
// options.bijective); targets not listed in `missed` are met bit for bit. There is no guarantee
// that targets are reached even if a map on this triangulation exists: the path is found by
// descent, and refinement may be needed (thesis 3.3). stats: those of minimize_distortion() and
// "targets.fraction".
TargetsResult minimize_with_targets(const mesh::Surface& chart, const Points2& initial_uv,
                                    const std::vector<std::pair<VertexId, Vector2>>& targets,
                                    const MinimizeOptions& options, ExecutionContext& context,
                                    Stats& stats);

}  // namespace flipfree::distortion
