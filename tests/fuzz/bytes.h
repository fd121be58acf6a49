// The bytes of a fuzzer read as choices. Past their end every choice is zero, so every input is a
// case and shorter ones are simpler.
#pragma once

#include <cstddef>
#include <cstdint>

#include "flipfree/base/types.h"

namespace flipfree::fuzz {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  bool empty() const { return left_ == 0; }
  std::size_t left() const { return left_; }
  std::uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  bool flag() { return (byte() & 1) != 0; }
  // In [0, count), from one byte, or two where one does not reach. Precondition: count > 0.
  Index below(Index count) {
    const Index value = count <= 256 ? byte() : byte() + 256 * byte();
    return value % count;
  }
  Index between(Index low, Index high) { return low + below(high - low + 1); }
  // A multiple of 1/8 in [-16, 16): many are equal and collinear, none are rounded.
  double eighth() { return static_cast<double>(static_cast<std::int8_t>(byte())) / 8.0; }
  // In [-1, 1), 16 bits.
  double fraction();
  // A finite double: a multiple of 1/8, a fraction, one times a power of ten in [1e-308, 1e308],
  // or eight bytes as they come.
  double number();
  // The same, or NaN or infinite.
  double any_number();

 private:
  std::uint64_t word();
  const std::uint8_t* data_;
  std::size_t left_;
};

}  // namespace flipfree::fuzz
