// Pins of face corners as pins of the charts' vertices.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/certify/certify.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

// Flags of the vertices that have a pinned corner; empty without pins.
std::vector<char> pinned_vertices(const mesh::Surface& surface,
                                  const std::vector<certify::CornerPin>& pins);

struct ChartPins {
  std::vector<std::vector<std::pair<VertexId, Vector2>>> of_chart;  // chart vertices
};

// Corner pins as pins of chart vertices; corners that share a chart vertex must agree. Throws
// InvalidInput (kBadPins) for corners that do not exist, places that are not finite, and two places
// for one vertex of a chart; NotConverged (kBadPins) where an added cut had to run through a pin.
ChartPins pins_by_chart(const Islands& islands, const std::vector<certify::CornerPin>& pins);

}  // namespace flipfree::unwrap
