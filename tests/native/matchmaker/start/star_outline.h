// The boundary of a disk on an outline with three arms.
#pragma once

#include <cmath>
#include <numbers>

#include "flipfree/matchmaker/request/constraints.h"

namespace flipfree::test {

inline matchmaker::Constraints star_outline(const mesh::RefinedSurface& surface) {
  matchmaker::Constraints constraints;
  const auto n = static_cast<double>(surface.boundary.size());
  for (std::size_t i = 0; i < surface.boundary.size(); ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / n;
    const double radius = 1 + 0.5 * std::cos(3 * angle);
    constraints.outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return constraints;
}

}  // namespace flipfree::test
