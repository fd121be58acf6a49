// Pieces of very different size, each in a unit in which squares of areas neither overflow nor
// vanish.
#pragma once

#include <optional>

#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// Binary exponents of a piece's extent up to which it stays as it is.
inline constexpr int kOrdinaryExponent = 64;

// A surface divided by a power of two near its extent, which is exact but for what vanishes beside
// it; as it is if that is within 2^-64 and 2^64. Where that leaves the range of numbers, the
// surface is moved to the origin first. The surface must outlive it. Cost: O(#F).
class InOwnUnit {
 public:
  explicit InOwnUnit(const Surface& surface);

  const Surface& surface() const { return scaled_ ? *scaled_ : given_; }
  // What lengths of surface() must be multiplied by to be those of the given one.
  double unit() const { return unit_; }

 private:
  const Surface& given_;
  std::optional<Surface> scaled_;
  double unit_ = 1.0;
};

}  // namespace flipfree::mesh
