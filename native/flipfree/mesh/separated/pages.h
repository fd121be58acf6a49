// Whole pages: what is wound against the rest, and is cut off rather than turned over.
#pragma once

#include <vector>

#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// A page has at least so many triangles, fewer are stray faces,
inline constexpr Index kPageTriangles = 8;
// at least this share of its part's area,
inline constexpr double kPageArea = 0.125;
// and at most this share of its border lies along faces that are wound against it: half of a sheet
// has a third there, half of a tube or a quarter of a sheet a half, half of a closed surface all.
inline constexpr double kPageLine = 0.6;

// Lower half-edges of the mates between pages, ascending. `turned`: #F, the faces that are to be
// turned over so that all mates agree that are not at seams; parts are the faces joined by these.
// Regions of one winding that are no page, being too small or too enclosed, go with the pages
// around them. The largest of a part's is a page whatever its border. Polygons are never parted.
// Cost: O(#F).
std::vector<HalfedgeId> lines_between_pages(const PairingInput& input,
                                            const std::vector<HalfedgeId>& mate,
                                            const std::vector<char>& turned);

}  // namespace flipfree::mesh
