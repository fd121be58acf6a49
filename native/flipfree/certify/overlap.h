// Do two charts of a map cover a common piece of the plane? For whoever asks for few of the pairs.
#pragma once

#include <cstddef>
#include <functional>

#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::certify {

// As island_overlaps() (measures.h) decides it; trees are made of the charts that are asked for.
// Not by several threads. The map (3 #F x 2) must outlive it.
std::function<bool(std::size_t, std::size_t)> sharing_area(const mesh::Components& charts,
                                                           const Points2& corner_uv);

}  // namespace flipfree::certify
