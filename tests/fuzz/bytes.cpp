#include "bytes.h"

#include <bit>
#include <cmath>
#include <limits>

namespace flipfree::fuzz {

double Bytes::fraction() {
  const int value = byte() * 256 + byte();
  return (value - 32768) / 32768.0;
}

std::uint64_t Bytes::word() {
  std::uint64_t value = 0;
  for (int i = 0; i < 8; ++i) value = value << 8 | byte();
  return value;
}

double Bytes::any_number() {
  switch (byte() % 8) {
    case 0:
    case 1:
    case 2:
      return eighth();
    case 3:
    case 4:
      return fraction();
    case 5: {
      const double value = fraction();
      return value * std::pow(10.0, below(617) - 308);
    }
    case 6:
      return std::bit_cast<double>(word());
    default:
      switch (byte() % 4) {
        case 0:
          return std::numeric_limits<double>::quiet_NaN();
        case 1:
          return std::numeric_limits<double>::infinity();
        case 2:
          return std::numeric_limits<double>::max();
        default:
          return std::numeric_limits<double>::denorm_min();
      }
  }
}

double Bytes::number() {
  const double value = any_number();
  return std::isfinite(value) ? value : 0.0;
}

}  // namespace flipfree::fuzz
