// What templates over the scalar type need beyond arithmetic: conversions, precision, pi. Types:
// double and BigFloat.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "flipfree/numeric/big_float.h"

namespace flipfree::numeric {

template <typename T>
struct ScalarTraits;

template <>
struct ScalarTraits<double> {
  static constexpr bool kIsDouble = true;
  static constexpr int kMaxBits = 53;
  static double make(double value, int /*bits*/) { return value; }
  static double pi(int /*bits*/) { return std::numbers::pi; }
  // 2^exponent. As a double it is zero where runs have more than a thousand bits.
  static double power_of_two(int exponent, int /*bits*/) { return std::ldexp(1.0, exponent); }
  static double to_double(double value) { return value; }
  static BigFloat<64> to_big(double value) { return BigFloat<64>(value); }
  template <int Limbs>
  static double from_big(const BigFloat<Limbs>& value, int /*bits*/) {
    return value.to_double();
  }
  static double scaled(double value, std::int64_t& exponent) {
    exponent = 0;
    return value;
  }
  static bool finite(double value) { return std::isfinite(value); }
};

template <int Limbs>
struct ScalarTraits<BigFloat<Limbs>> {
  static constexpr bool kIsDouble = false;
  static constexpr int kMaxBits = BigFloat<Limbs>::kMaxBits;
  static BigFloat<Limbs> make(double value, int bits) { return BigFloat<Limbs>(value, bits); }
  static BigFloat<Limbs> pi(int bits) { return BigFloat<Limbs>::pi(bits); }
  static BigFloat<Limbs> power_of_two(int exponent, int bits) {
    return BigFloat<Limbs>::power_of_two(exponent, bits);
  }
  static double to_double(const BigFloat<Limbs>& value) { return value.to_double(); }
  static BigFloat<64> to_big(const BigFloat<Limbs>& value) {
    return BigFloat<64>::rounded(value, value.bits());
  }
  template <int OtherLimbs>
  static BigFloat<Limbs> from_big(const BigFloat<OtherLimbs>& value, int bits) {
    return BigFloat<Limbs>::rounded(value, bits);
  }
  static double scaled(const BigFloat<Limbs>& value, std::int64_t& exponent) {
    return value.to_double_scaled(exponent);
  }
  static bool finite(const BigFloat<Limbs>& value) { return value.finite(); }
};

// As 80-bit numbers, for their range.
inline long double widen(double x) { return x; }
inline long double widen(long double x) { return x; }
template <int Limbs>
long double widen(const BigFloat<Limbs>& x) {
  return mpfr_get_ld(x.raw(), MPFR_RNDN);
}

// numerator / denominator as a double, without over- or underflow on the way.
template <typename T>
double ratio(const T& numerator, const T& denominator) {
  if constexpr (ScalarTraits<T>::kIsDouble) {
    return numerator / denominator;
  } else {
    std::int64_t en = 0;
    std::int64_t ed = 0;
    const double n = ScalarTraits<T>::scaled(numerator, en);
    const double d = ScalarTraits<T>::scaled(denominator, ed);
    const std::int64_t e = en - ed;
    if (e < -1070) return 0.0;
    return std::ldexp(n / d, e > 1000 ? 1000 : static_cast<int>(e));
  }
}

}  // namespace flipfree::numeric
