// How work on all faces is split between threads in this stage.
#pragma once

#include <cstddef>

namespace flipfree::distortion {

// Faces that one thread takes at a time: a fraction of a millisecond. Sums are taken per grain, so
// that the bits of results depend on it. benchmarks/unwrap.py scale measures it.
inline constexpr std::size_t kGrain = 8192;

}  // namespace flipfree::distortion
