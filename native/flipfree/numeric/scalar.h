// What templates over the scalar type need beyond arithmetic: conversions, precision, pi. Types:
// double and BigFloat.
#pragma once

#include <mpfr.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <type_traits>

namespace flipfree::numeric {
// MPFR numbers of a precision chosen at run time, stored in place: no allocation per number or
// operation.
//
// BigFloat<Limbs> holds a mantissa of up to 64 * Limbs bits. The precision of a result is the
// larger one of its operands, so a computation runs in the precision of its inputs; a double enters
// with 53 bits, exactly. The exponent has 63 bits: no overflow in practice. All operations round to
// nearest and are deterministic.

template <int Limbs>
class BigFloat {
 public:
  static constexpr int kMaxBits = 64 * Limbs;
  static_assert(GMP_NUMB_BITS == 64);

  BigFloat() : BigFloat(0.0) {}
  BigFloat(double value, int bits = 53) {  // NOLINT: implicit on purpose, doubles enter exactly
    start(bits);
    mpfr_set_d(value_, value, MPFR_RNDN);
  }
  BigFloat(const BigFloat& other) { copy(other); }
  BigFloat& operator=(const BigFloat& other) {
    if (this != &other) copy(other);
    return *this;
  }
  static constexpr bool kIsDouble = false;
  static BigFloat make(double value, int bits) { return BigFloat(value, bits); }
  static BigFloat power_of_two(int exponent, int bits) {
    BigFloat r(0.0, bits);
    mpfr_set_ui_2exp(r.value_, 1, exponent, MPFR_RNDN);
    return r;
  }
  static BigFloat pi(int bits) {
    BigFloat r(0.0, bits);
    mpfr_const_pi(r.value_, MPFR_RNDN);
    return r;
  }
  // The same number rounded to another precision.
  template <int OtherLimbs>
  static BigFloat rounded(const BigFloat<OtherLimbs>& other, int bits) {
    BigFloat r(0.0, bits);
    mpfr_set(r.value_, other.raw(), MPFR_RNDN);
    return r;
  }
  static BigFloat<64> to_big(const BigFloat& value) {
    return BigFloat<64>::rounded(value, value.bits());
  }
  static double to_double(const BigFloat& value) { return value.to_double(); }
  // value = mantissa * 2^exponent with |mantissa| in [1/2, 1); 0 has exponent 0.
  static double scaled(const BigFloat& value, std::int64_t& exponent) {
    long e = 0;
    const double m = mpfr_get_d_2exp(&e, value.value_, MPFR_RNDN);
    exponent = e;
    return m;
  }
  static bool finite(const BigFloat& value) { return mpfr_number_p(value.value_) != 0; }

  int bits() const { return static_cast<int>(mpfr_get_prec(value_)); }
  mpfr_srcptr raw() const { return value_; }
  double to_double() const { return mpfr_get_d(value_, MPFR_RNDN); }
  int sign() const { return mpfr_sgn(value_); }

  friend BigFloat operator+(const BigFloat& a, const BigFloat& b) { return binary(a, b, mpfr_add); }
  friend BigFloat operator-(const BigFloat& a, const BigFloat& b) { return binary(a, b, mpfr_sub); }
  friend BigFloat operator*(const BigFloat& a, const BigFloat& b) { return binary(a, b, mpfr_mul); }
  friend BigFloat operator/(const BigFloat& a, const BigFloat& b) { return binary(a, b, mpfr_div); }
  BigFloat operator-() const {
    BigFloat r(*this);
    mpfr_neg(r.value_, r.value_, MPFR_RNDN);
    return r;
  }
  BigFloat& operator+=(const BigFloat& b) { return *this = *this + b; }
  BigFloat& operator-=(const BigFloat& b) { return *this = *this - b; }
  BigFloat& operator*=(const BigFloat& b) { return *this = *this * b; }
  BigFloat& operator/=(const BigFloat& b) { return *this = *this / b; }

  friend bool operator<(const BigFloat& a, const BigFloat& b) {
    return mpfr_less_p(a.value_, b.value_) != 0;
  }
  friend bool operator>(const BigFloat& a, const BigFloat& b) { return b < a; }
  friend bool operator<=(const BigFloat& a, const BigFloat& b) {
    return mpfr_lessequal_p(a.value_, b.value_) != 0;
  }
  friend bool operator>=(const BigFloat& a, const BigFloat& b) { return b <= a; }
  friend bool operator==(const BigFloat& a, const BigFloat& b) {
    return mpfr_equal_p(a.value_, b.value_) != 0;
  }

  friend BigFloat sqrt(const BigFloat& a) { return unary(a, mpfr_sqrt); }
  friend BigFloat exp(const BigFloat& a) { return unary(a, mpfr_exp); }
  friend BigFloat log(const BigFloat& a) { return unary(a, mpfr_log); }
  friend BigFloat abs(const BigFloat& a) {
    BigFloat r(a);
    mpfr_abs(r.value_, r.value_, MPFR_RNDN);
    return r;
  }
  friend BigFloat atan2(const BigFloat& y, const BigFloat& x) { return binary(y, x, mpfr_atan2); }

 private:
  template <int>
  friend class BigFloat;
  struct Uninitialised {};
  explicit BigFloat(Uninitialised) {}

  // The significand lives in limbs_ (MPFR's custom interface), so the precision can be set without
  // allocation.
  void start(int bits) {
    mpfr_custom_init(limbs_, bits);
    mpfr_custom_init_set(value_, MPFR_ZERO_KIND, 0, bits, limbs_);
  }
  void copy(const BigFloat& other) {
    std::memcpy(&value_, &other.value_, sizeof(value_));
    const std::size_t words = static_cast<std::size_t>((other.value_->_mpfr_prec + 63) / 64);
    std::memcpy(limbs_, other.limbs_, words * sizeof(mp_limb_t));
    mpfr_custom_move(value_, limbs_);
  }
  template <typename Operation>
  static BigFloat unary(const BigFloat& a, Operation operation) {
    BigFloat r{Uninitialised{}};
    r.start(a.bits());
    operation(r.value_, a.value_, MPFR_RNDN);
    return r;
  }
  template <typename Operation>
  static BigFloat binary(const BigFloat& a, const BigFloat& b, Operation operation) {
    BigFloat r{Uninitialised{}};
    r.start(std::max(a.bits(), b.bits()));
    operation(r.value_, a.value_, b.value_, MPFR_RNDN);
    return r;
  }

  mpfr_t value_;
  mp_limb_t limbs_[Limbs];
};

struct DoubleTraits {
  static constexpr bool kIsDouble = true;
  static double make(double value, int /*bits*/) { return value; }
  static double pi(int /*bits*/) { return std::numbers::pi; }
  // 2^exponent. As a double it is zero where runs have more than a thousand bits.
  static double power_of_two(int exponent, int /*bits*/) { return std::ldexp(1.0, exponent); }
  static double to_double(double value) { return value; }
  static BigFloat<64> to_big(double value) { return BigFloat<64>(value); }
  template <int Limbs>
  static double rounded(const BigFloat<Limbs>& value, int /*bits*/) {
    return value.to_double();
  }
  static double scaled(double value, std::int64_t& exponent) {
    exponent = 0;
    return value;
  }
  static bool finite(double value) { return std::isfinite(value); }
};

template <typename T>
using ScalarTraits = std::conditional_t<std::is_same_v<T, double>, DoubleTraits, T>;

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
