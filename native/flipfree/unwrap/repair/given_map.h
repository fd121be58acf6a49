// Corners that were torn off a map, joined to it again.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certify.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/chart/chart.h"

namespace flipfree::unwrap {

// A map as somebody left it, read as charts: every corner has a value, and pins are at their
// places.

struct GivenMap {
  Points2 uv;                           // 3 #F x 2, finite
  mesh::EdgeFlags cuts;                 // where the values on the two sides of an edge differ
  std::vector<mesh::Chart> charts;      // chart.vertices number the places that corners share
  std::vector<VertexId> vertex_origin;  // of these places: vertex of the surface
  Index rejoined = 0;                   // corners that were torn off
  // Per chart: its vertices' places (#V x 2); those that had none that 32 bits hold, so that theirs
  // is only a guess; and its pins, ascending by vertex.
  std::vector<Points2> places;
  std::vector<std::vector<char>> unknown;
  ChartPins pins;
};

// corner_uv: 3 #F x 2, any values. A corner without a value takes that of the next corner around
// its vertex, but not across an edge of `seams` (flags, may be empty), nor across one of which the
// other end does not tell whether the map goes on; the mean of its neighbours where there is none.
// A pin moves all corners that share its corner's place. Throws InvalidInput (kBadPins): one of a
// corner that does not exist or at a place that UVs cannot store, two places for one vertex of a
// chart. Precondition: a validated surface. Cost: O(#F).
GivenMap read_map(const mesh::Surface& surface, const Points2& corner_uv,
                  const mesh::EdgeFlags& seams, const std::vector<certify::CornerPin>& pins);

// Where the texture shows the charts' places and pins, see CertifyRequest::aspect.
std::vector<Points2> on_texture(std::vector<Points2> places, double aspect);
VertexPins on_texture(VertexPins pins, double aspect);

// What repair() says of the map as it was: "flips_before" and their like, see repair.h.
// `corner_uv`: as it was given to read_map().
void measure_before(const mesh::Surface& surface, const GivenMap& map, const Points2& corner_uv,
                    double aspect, Stats& stats, const ExecutionContext& context);

}  // namespace flipfree::unwrap
