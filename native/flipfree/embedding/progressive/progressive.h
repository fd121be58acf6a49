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
#include "flipfree/base/stats.h"
#include "flipfree/embedding/progressive/planar_map.h"

namespace flipfree::embedding {

enum class ProgressiveStart {
  kRepair,   // keep map.uv, collapse invalid triangles, smooth near them alone
  kInitial,  // keep map.uv, collapse invalid triangles (thesis)
  kNothing,  // ignore map.uv: collapse everything
};

struct ProgressiveOptions {
  ProgressiveStart start = ProgressiveStart::kInitial;
  // Whole-mesh sweeps, run each time the mesh has grown by `growth`, and at the end.
  int sweeps = 2;
  double growth = 1.5;
  int final_sweeps = 5;
  // Around each insertion: at most this many Newton steps per edge of the new vertex (thesis: 10
  // iterations over the whole mesh); a vertex that moved less than `settled` star sizes does not
  // wake its neighbours.
  int local_steps = 2;
  double settled = 0.3;
};

// Two to three times as much smoothing: for starts that are far from a good map.
inline ProgressiveOptions thorough(ProgressiveStart start) {
  return {.start = start,
          .sweeps = 3,
          .growth = 1.25,
          .final_sweeps = 10,
          .local_steps = 10,
          .settled = 0.1};
}

// On return every face of map is positive by exact test, as given and as stored.
// Stats: "collapses", "insertion_retries", "recollapses" (collapses repeated because an insertion
// found no room), "seconds_simplify", "seconds_insert". Throws NotConverged (kNoRoomInPolygon: no
// room for a vertex alone; kIterationLimit: an insertion failed whatever the smoothing), Cancelled.
void progressive_embedding(PlanarMap& map, const ProgressiveOptions& options,
                           ExecutionContext& context, Stats& stats);

}  // namespace flipfree::embedding
