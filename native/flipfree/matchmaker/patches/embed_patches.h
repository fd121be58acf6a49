// Phase 3 of MatchMaker++ (thesis 3.3): every patch onto its convex polygon, welded.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/patches/trace_paths.h"

namespace flipfree::matchmaker {

// Positions of all mesh vertices (#V x 2 of the refined mesh). Points along a path are spread over
// its straight side by the lengths of the path's edges, once per path, so that patches fit together
// bit for bit. Inner edges of a patch that join two points of one straight side are split first.
// Isolated vertices keep (0, 0).
//
// Guarantee: every face is positively oriented by exact test. Throws what embed_disk throws.
Points2 embed_patches(mesh::RefinedSurface& surface, const TargetDomain& domain,
                      const ConvexPartition& partition, const Paths& paths,
                      ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
