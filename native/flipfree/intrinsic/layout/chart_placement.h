// Where the charts of a layout lie in the unit square.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/layout/development.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::intrinsic {

// Turns every chart so that its longest boundary edge is horizontal, sets charts side by side, and
// scales the whole into the unit square.
struct ChartPlacement {
  std::vector<Place> direction;  // per chart: unit complex number by which it is turned
  std::vector<Place> shift;      // per chart, added after turning
  long double scale = 1;
  Place origin;  // subtracted last but one, before scaling
  Vector2 apply(const Place& p, Index chart) const {
    const Place& d = direction[static_cast<std::size_t>(chart)];
    const Place& s = shift[static_cast<std::size_t>(chart)];
    const long double x = p.x * d.x - p.y * d.y + s.x - origin.x;
    const long double y = p.x * d.y + p.y * d.x + s.y - origin.y;
    return {static_cast<double>(x * scale), static_cast<double>(y * scale)};
  }
};

ChartPlacement place_charts(const Development& development, const mesh::Adjacency& adjacency,
                            const ExecutionContext& context);

// Where the map is finest among these faces (those that could not be rounded): 32-bit numbers are
// finest around zero.
Place finest_place(const Development& development, const ChartPlacement& placement,
                   const std::vector<FaceId>& faces);

}  // namespace flipfree::intrinsic
