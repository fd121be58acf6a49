// Less distortion for an existing map, without a flip on the way.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::unwrap {

struct ImproveOptions {
  std::vector<certify::CornerPin>
      pins;                    // met bit for bit; corners that share a chart's vertex share the pin
  bool keep_bijective = true;  // charts that do not overlap themselves go on not to
  int max_iterations = 200;    // per chart
  double tolerance = 1e-4;     // share of the energy that a step must still promise
  double max_seconds = 0;      // of the clock; 0: no limit. What was gained by then is kept
  double aspect = 1.0;         // CertifyRequest::aspect: distortion is that on such a texture
};

// corner_uv: 3 #F x 2, every triangle positively oriented. The map is cut where the UVs on the two
// sides of an edge differ; each piece is one chart. All charts get one common scale, that of the
// whole map before; each keeps its centre and direction as well as it can, so charts that touched
// may overlap each other afterwards. Charts with pins are where the pins say.
//
// Guarantee: the result is certified as by certify_map (G1, G2, G3, G7); without pins its energy is
// not higher than the input's (if no improvement was found, the input's own UVs come back), unless
// these fold where they are rounded to 32 bits, which costs what unfolding them costs. Stats:
// "charts", "energy_before", "energy", "seconds", "time_limit_reached", and what the solver reports
// of the largest chart. Any triangles: what is no oriented manifold surface is separated first,
// along the map. Throws InvalidInput (a mesh without meaning; kBadOption naming the flipped faces;
// kBadPins), NotConverged (a pin was not reached, or not in max_seconds: kTimeLimit; rounding;
// certificate), Cancelled.
certify::Parametrization improve(const mesh::Surface& surface, const Points2& corner_uv,
                                 const ImproveOptions& options, ExecutionContext& context);

// improve() of any map: one with flipped faces is repaired first, its overlaps kept. Then stats
// also has what repair() says of the map before and of its charts.
certify::Parametrization improve_any(const mesh::Surface& surface, const Points2& corner_uv,
                                     const ImproveOptions& options, ExecutionContext& context);

}  // namespace flipfree::unwrap
