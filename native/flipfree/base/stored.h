// What is left of a coordinate once it is stored in 32 bits (G1), as a double again.
//
// Written out, `static_cast<double>(static_cast<float>(x))` is a conversion there and back that a
// compiler may take for nothing: GCC 12's straight-line vectorizer does with pairs of them, and
// what was certified as stored was not. So the value goes through a memory cell that no optimiser
// may skip, and this is the one place that does it (tests/native/base/stored_test.cpp).
#pragma once

#include "flipfree/base/types.h"

namespace flipfree {

inline double as_stored(double x) {
  volatile float cell = static_cast<float>(x);
  return cell;
}

inline Vector2 as_stored(const Vector2& p) { return {as_stored(p.x()), as_stored(p.y())}; }

inline Points2 as_stored(Points2 points) {
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = as_stored(points.data()[i]);
  return points;
}

}  // namespace flipfree
