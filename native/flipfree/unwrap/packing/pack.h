// An existing map's charts, moved into the unit square, clear of what lies there: similarities
// only, so that what a solver achieved stays.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/unwrap/packing/place.h"

namespace flipfree::unwrap {

struct PackOptions : PlacingOptions {
  // Charts with faces of equal number keep their places relative to each other and move as one;
  // kInvalid: alone. One number per face, or empty. Not together.
  std::vector<Index> groups;
  // Charts with faces of equal number have a layout of their own, each as large as its tile allows:
  // that of the k-th number in the k-th tile from first_tile on or, with share_tile, all in the
  // first one, on top of each other, as for textures of their own. One number per face, or empty:
  // one layout. Neither together nor with place_like; one tile each.
  std::vector<Index> layouts;
  bool share_tile = false;
  // Charts of one connected surface component turn together and are scaled together: where the two
  // sides of a cut are related by a rotation and a translation, they stay so, with the same
  // rotation. Otherwise each chart turns to its own smallest rectangle. Not with place_like.
  bool together = false;
  bool keep_bijective = true;  // charts that do not overlap themselves still do not once rounded
  // Charts with one of these corners stay where they are, these corners bit for bit. The others
  // keep clear of them.
  std::vector<CornerId> unmoved;
  // 3 k x 2: triangles to keep clear of as well, of either orientation, degenerate ones too.
  Points2 obstacles;
};

// corner_uv: 3 #F x 2, every triangle positively oriented (but for stack_mirrored); the map is cut
// where the UVs on the two sides of an edge differ. Certified as by certify_map (G1, G2, G7). Any
// triangles: what is no oriented manifold surface is separated first, along the map. Stats:
// "charts", "seconds", "density" (of all that was moved), "kept_places" (0 or 1), "tile"
// (rectangles.h: 0 is the unit square), "tiles" (taken), "fill", "stacked" and "margin_met" (0
// or 1; place.h). Throws InvalidInput (a mesh without meaning, kBadOption naming flipped faces or
// if there is no room, kBadShape), NotConverged (rounding, certificate), Cancelled. Cost: O(#F log
// #F).
certify::Parametrization pack(const mesh::Surface& surface, const Points2& corner_uv,
                              const PackOptions& options, ExecutionContext& context);

}  // namespace flipfree::unwrap
