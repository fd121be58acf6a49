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
inline Eigen::RowVector2d row_from_texture(const Eigen::RowVector2d& seen, double aspect,
                                           const Eigen::RowVector2d& before) {
  const bool stays = seen.x() == before.x() * aspect && seen.y() == before.y();
  return stays ? before : Eigen::RowVector2d(seen.x() / aspect, seen.y());
}
inline Points2 from_texture(const Points2& seen, double aspect, const Points2& before) {
  Points2 uv(seen.rows(), 2);
  for (Eigen::Index i = 0; i < uv.rows(); ++i)
    uv.row(i) = row_from_texture(seen.row(i), aspect, before.row(i));
  return uv;
}

}  // namespace flipfree::certify
