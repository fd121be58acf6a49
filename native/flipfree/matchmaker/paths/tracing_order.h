// In which order the paths of phase 2 are traced.
#pragma once

#include <vector>

#include "flipfree/matchmaker/target/target_domain.h"

namespace flipfree::matchmaker {

// Edges of the partition that are no outline edges and not `settled` (their paths are given), each
// once. First a minimum spanning tree grown from what is connected to the outline (Praun, Sweldens,
// Schroeder 2001): its paths close no loop. Each of the rest divides one piece in two; they come so
// that both halves have about the same number of sides, hence a piece is divided O(log n) times.
// Cost: O(n log n) for n edges.
std::vector<Index> tracing_order(const TargetDomain& domain, const ConvexPartition& partition,
                                 const std::vector<bool>& settled);

}  // namespace flipfree::matchmaker
