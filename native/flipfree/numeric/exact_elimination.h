// Exact elimination of homogeneous linear constraints with Gaussian integer coefficients: which
// unknowns are free, and how the others follow from them.
//
// Complex unknowns make quarter turns numbers (multiplication by i), so that constraints of points
// in the plane are half as many and stay sparse; ordinary integers are those without an imaginary
// part. After Mandad, Campen 2019, "Exact Constraint Satisfaction for Truly Seamless
// Parametrization".
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::numeric {

struct GaussianInteger {
  std::int64_t re = 0;
  std::int64_t im = 0;
  bool operator==(const GaussianInteger&) const = default;
  bool is_zero() const { return re == 0 && im == 0; }
  bool is_unit() const { return (re == 0) != (im == 0) && re + im <= 1 && re + im >= -1; }
};
// Without care for overflow: for factors that are known to be small.
constexpr GaussianInteger operator*(const GaussianInteger& a, const GaussianInteger& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
constexpr GaussianInteger operator+(const GaussianInteger& a, const GaussianInteger& b) {
  return {a.re + b.re, a.im + b.im};
}
constexpr GaussianInteger operator-(const GaussianInteger& a) { return {-a.re, -a.im}; }
// i^k, any k.
constexpr GaussianInteger quarter_turn(Index k) {
  constexpr GaussianInteger powers[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  return powers[((k % 4) + 4) % 4];
}

struct Term {
  Index unknown = kInvalid;
  GaussianInteger factor;
};
// Sum of factor times unknown: sorted by unknown, each once, no factor zero.
using LinearForm = std::vector<Term>;

// Sorts, adds up terms of the same unknown and leaves zeros out.
void normalise(LinearForm& form);

// form + factor * other. Nothing if a number outgrows 64 bits.
std::optional<LinearForm> sum(const LinearForm& form, const GaussianInteger& factor,
                              const LinearForm& other);

struct Elimination {
  // Per unknown: its value is `form` divided by `divisor` > 0; forms have free unknowns only.
  struct Value {
    LinearForm form;
    std::int64_t divisor = 1;
  };
  std::vector<Value> value;
  std::vector<char> free;  // 1: its value is itself
};

// Solves rows = 0. Pivots are units wherever there are any, rows with few terms and unknowns in few
// rows first, so that values stay short and divisors are one. Nothing if a number outgrows 64 bits.
// Cost: that of the sparse elimination; O(terms log terms) where rows form a forest.
std::optional<Elimination> eliminate(Index unknowns, const std::vector<LinearForm>& rows,
                                     const ExecutionContext& context);

}  // namespace flipfree::numeric
