// Maps as textures show them that are no squares: UVs run from 0 to 1 along both sides of an image,
// however wide it is.
#pragma once

#include "flipfree/base/types.h"

namespace flipfree::certify {

// UVs in the texture's pixels, its height as the unit; aspect: its width over its height.
inline Points2 on_texture(const Points2& uv, double aspect) {
  Points2 seen = uv;
  if (aspect != 1.0) seen.col(0) *= aspect;
  return seen;
}
inline Vector2 on_texture(const Vector2& uv, double aspect) { return {uv.x() * aspect, uv.y()}; }

// The UVs of what the texture shows; what is where `before` is seen has its values bit for bit.
inline Points2 from_texture(const Points2& seen, double aspect, const Points2& before) {
  Points2 uv = seen;
  for (Eigen::Index i = 0; i < uv.rows(); ++i) {
    const bool stays = seen(i, 0) == before(i, 0) * aspect && seen(i, 1) == before(i, 1);
    uv(i, 0) = stays ? before(i, 0) : seen(i, 0) / aspect;
    if (stays) uv(i, 1) = before(i, 1);
  }
  return uv;
}

}  // namespace flipfree::certify
