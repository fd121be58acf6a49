// Phase 3 of MatchMaker++ (thesis 3.3): every patch onto its convex polygon, welded.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/paths/trace_paths.h"

namespace flipfree::matchmaker {

// Positions of all mesh vertices (#V x 2 of the refined mesh). Points along a path are spread over
// its straight side by the lengths of the path's edges, once per path, so that patches fit together
// bit for bit. Inner edges of a patch that join two points of one straight side are split first.
// Isolated vertices keep (0, 0). With the drawing in which the paths were traced, lengths and
// shapes are taken from there; vertices that are added here are appended to it.
//
// Guarantee: every face is positively oriented by exact test. Throws what embed_disk throws.
Points2 embed_patches(mesh::RefinedSurface& surface, const TargetDomain& domain,
                      const ConvexPartition& partition, const Paths& paths,
                      ExecutionContext& context, Stats& stats,
                      std::vector<Vector2>* drawing = nullptr);

}  // namespace flipfree::matchmaker
