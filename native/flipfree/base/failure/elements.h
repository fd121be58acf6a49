// The elements that an error or a certificate names: how many, and the faces there.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/types.h"

namespace flipfree {

// Enough to select and to look at, few enough to hand on where a whole mesh is at fault.
inline constexpr std::size_t kMostElements = 1000;

inline std::vector<Index> first_elements(const std::vector<Index>& elements) {
  return {elements.begin(),
          elements.begin() + static_cast<std::ptrdiff_t>(std::min(elements.size(), kMostElements))};
}

// The faces that an error names, or those at the vertices that it names; none of other kinds. Cost:
// O(#F) times the vertices.
std::vector<FaceId> faces_at(const Error& error, const Triangles& faces);

}  // namespace flipfree
