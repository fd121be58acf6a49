// The ids in a sentence for people, in another numbering.
#pragma once

#include <functional>
#include <string>

#include "flipfree/base/types.h"

namespace flipfree {

struct Renumbering {
  std::function<Index(Index)> vertex;
  std::function<Index(Index)> face;
  std::function<Index(Index)> corner;
};

// Our messages name an element by its word and its id: "vertex 3", "vertices 3 and 5", "edge 3-5",
// "face 7", "corner 21", in small or with a capital. These ids are renumbered, nothing else is. An
// id that its function maps to kInvalid stays.
std::string renumbered(const std::string& text, const Renumbering& numbers);

}  // namespace flipfree
