// Slits made shorter: what earns little for its length is given back.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/unwrap/seams/search/sheet.h"

namespace flipfree::unwrap {

struct Shortened {
  std::vector<Sheet::Way> ways;  // of the sheet; those that are left
  std::vector<VertexId> ends;    // where they end, and one vertex of every hole that they open
  double excess = 0.0;           // Sheet::excess() with these
};

// The slits of the sheet, each ending sooner or left out, such that excess() is at most `most`: the
// end that costs least for its length goes first, by the first-order response of the scale field
// (ScaleField::respond), and every few steps it is solved. What opens a hole stays, what ends in a
// tip, such as that of a cone, and of a closed chart two edges. The same slits if excess() is above
// `most` already. Cost: some ten factorizations. Throws Cancelled, TimeIsOver.
Shortened shortened(Sheet& sheet, double most, ExecutionContext& context);

}  // namespace flipfree::unwrap
