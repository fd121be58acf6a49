// Planar maps for tests of what simplifies, smooths and refills them.
#pragma once

#include "embedding/disks.h"
#include "flipfree/embedding/progressive/planar_map.h"
#include "flipfree/embedding/tutte/tutte.h"

namespace flipfree::test {

// A valid map of a disk, in floats or doubles.
inline embedding::PlanarMap valid_map(const Disk& disk, bool float32) {
  ExecutionContext context;
  return embedding::make_planar_map(
      disk.surface.faces, disk.loop,
      embedding::tutte_uniform(disk.surface.faces, disk.vertex_count(), disk.loop, disk.boundary,
                               context),
      float32);
}

}  // namespace flipfree::test
