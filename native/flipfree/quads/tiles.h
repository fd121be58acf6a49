// Tiles: a seamless map at a scale at which a texture that repeats runs on through its seams.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::quads {

struct TileOptions {
  double tile = 1.0;    // how long the side of a tile shall be on the surface
  IndexPairs features;  // edges of the map's faces that shall lie on lines between tiles, where
                        // they run along an axis
  bool prefer_translations = false;  // seams that turn are made shorter
  double max_seconds = 0.0;
};

// The map with tiles of side 1, in which transitions, cones, corners, borders and features along
// the axes are whole numbers, as stored (G9); other borders stay free. Edges that this bends so far
// that faces flip get points (transfer.h). Where integers of that size leave no map, tiles are
// smaller, in a few steps. Certified: G1, G2, G4, the map's own cones;
// features that are not met are named. stats: "tile" (how long its side came out: the square root
// of area on the surface per tile), "tiles" (how many), "seams" (edges), "seams_quarter" and
// "seams_half" (those that turn by a quarter or a half, where only a texture that looks the same
// so turned runs on), "seams_matched" (share of the seams' length that turns by none), and
// "carried" (distortion/seams/seams.h). Throws InvalidInput (not seamless as stored; no common
// grid), NotConverged, Cancelled.
certify::Parametrization fit_tiles(certify::Parametrization map, const TileOptions& options,
                                   ExecutionContext& context);

}  // namespace flipfree::quads
