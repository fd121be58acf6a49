// Progressive embedding (thesis 3.2.2): collapse what is invalid, insert it again one vertex at a
// time, smooth.
//
// Deviations from the thesis, measured in docs/method/pins.md: smoothing covers a work queue
// around each insertion instead of the whole mesh, and whole-mesh sweeps run only each time the
// mesh has grown by a fixed ratio, so that the total is near-linear; the energy's reference
// triangles carry shares (planar_map.h); positions are kept on the grid of 32-bit floats when the
// result has to survive storage.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/embedding/progressive/planar_map.h"

namespace flipfree::embedding {

enum class ProgressiveStart {
  kInitial,  // keep map.uv, collapse invalid triangles (thesis)
  kNothing,  // ignore map.uv: collapse everything
};

// On return every face of map is positive by exact test, as given and as stored.
// Throws
// NotConverged (kNoRoomInPolygon: no room for a vertex alone; kIterationLimit: an insertion failed
// whatever the smoothing), Cancelled.
void progressive_embedding(PlanarMap& map, ProgressiveStart start, ExecutionContext& context);

}  // namespace flipfree::embedding
