#include <gtest/gtest.h>

#include <boost/multiprecision/gmp.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "flipfree/numeric/exact_elimination.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::numeric::exact_test {
namespace {

using Rational = boost::multiprecision::mpq_rational;

int exact_orientation(const Vector2& a, const Vector2& b, const Vector2& c) {
  const Rational determinant =
      (Rational(b.x()) - Rational(a.x())) * (Rational(c.y()) - Rational(a.y())) -
      (Rational(b.y()) - Rational(a.y())) * (Rational(c.x()) - Rational(a.x()));
  return determinant.sign();
}

TEST(Orientation, agrees_with_rational_arithmetic_on_nearly_collinear_points) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    const Vector2 a(unit(random), unit(random));
    const Vector2 b(unit(random), unit(random));
    Vector2 c = a + unit(random) * (b - a);
    if (i % 3 == 0) c.x() = std::nextafter(c.x(), 2.0);
    EXPECT_EQ(orientation(a, b, c), exact_orientation(a, b, c));
  }
}

TEST(Orientation, is_exact_at_extreme_scales) {
  for (const int exponent : {-1070, -600, -300, 0, 300, 600, 1020}) {
    const double s = std::ldexp(1.0, exponent);
    const Vector2 a(s, s);
    const Vector2 b(2 * s, 2 * s);
    const Vector2 c(3 * s, 3 * s);
    const Vector2 above(3 * s, std::nextafter(3 * s, std::numeric_limits<double>::infinity()));
    EXPECT_EQ(orientation(a, b, c), 0) << exponent;
    EXPECT_EQ(orientation(a, b, above), 1) << exponent;
    EXPECT_EQ(orientation(b, a, above), -1) << exponent;
  }
}

TEST(Orientation, of_floats_is_that_of_the_same_numbers_as_doubles) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (int i = 0; i < 5000; ++i) {
    float p[6];
    for (float& x : p) x = unit(random);
    p[4] = p[0] + 0.5F * (p[2] - p[0]);
    p[5] = p[1] + 0.5F * (p[3] - p[1]);
    EXPECT_EQ(orientation(p, p + 2, p + 4),
              exact_orientation({p[0], p[1]}, {p[2], p[3]}, {p[4], p[5]}));
  }
}

TEST(InCircle, knows_the_corners_of_a_square_as_cocircular) {
  EXPECT_EQ(in_circle({0, 0}, {1, 0}, {1, 1}, {0, 1}), 0);
  EXPECT_EQ(in_circle({0, 0}, {1, 0}, {1, 1}, {0.5, 0.5}), 1);
  EXPECT_EQ(in_circle({0, 0}, {1, 0}, {1, 1}, {0, std::nextafter(1.0, 2.0)}), -1);
}

TEST(TwoProduct, is_exact_in_all_of_its_range_and_off_by_little_below) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> one_to_two(1.0, 2.0);
  std::uniform_int_distribution<int> exponent(-1074, 995);
  const Rational least(std::numeric_limits<double>::denorm_min());
  int exact = 0;
  int below = 0;
  for (int i = 0; i < 200000; ++i) {
    const int power = exponent(random);
    // Beside products of all sizes, as many near the lower bound as near the upper one.
    const int other = i % 3 == 0 ? exponent(random) : (i % 3 == 1 ? 1021 : -970) - power;
    if (other < -1074 || other > 995 || power + other > 1021) continue;
    const double x = std::ldexp(one_to_two(random), power);
    const double y = std::ldexp(i % 2 == 0 ? one_to_two(random) : -one_to_two(random), other);
    const Pair product = two_product(x, y);
    const Rational error =
        abs(Rational(x) * Rational(y) - Rational(product.high) - Rational(product.low));
    if (std::abs(product.high) >= std::ldexp(1.0, -969)) {
      ASSERT_EQ(error, 0) << x << " " << y;
      ++exact;
    } else {
      ASSERT_LT(error, 4 * least) << x << " " << y;
      ++below;
    }
  }
  EXPECT_GT(exact, 50000);
  EXPECT_GT(below, 10000);
}

TEST(SegmentsConflict, tells_crossings_touches_and_shared_ends_apart) {
  const Vector2 o(0, 0);
  EXPECT_TRUE(segments_conflict({-1, 0}, {1, 0}, {0, -1}, {0, 1})) << "crossing";
  EXPECT_TRUE(segments_conflict({-1, 0}, {1, 0}, o, {0, 1})) << "end inside the other segment";
  EXPECT_TRUE(segments_conflict(o, {2, 0}, o, {1, 0})) << "collinear overlap from a shared end";
  EXPECT_TRUE(segments_conflict(o, {2, 0}, {1, 0}, {3, 0})) << "collinear overlap";
  EXPECT_TRUE(segments_conflict(o, {1, 0}, {1, 0}, o)) << "the same segment";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, o, {0, 1})) << "shared end only";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, {1, 0}, {2, 0})) << "collinear, shared end only";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, {2, 0}, {3, 0})) << "collinear, apart";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, {0, 1}, {1, 1})) << "parallel";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, {2, -1}, {2, 1})) << "its line alone is crossed";
  EXPECT_FALSE(segments_conflict({2, -1}, {2, 1}, o, {1, 0})) << "the other's line alone";
}

TEST(Predicates, SayNothingOfWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const Vector2 a(0, 0);
  const Vector2 b(1, 0);
  const Vector2 c(0, 1);
  for (const double bad : {nan, infinity, -infinity}) {
    for (const Vector2& p : {Vector2(bad, 0.5), Vector2(0.5, bad), Vector2(bad, bad)}) {
      EXPECT_EQ(orientation(a, b, p), 0);
      EXPECT_EQ(orientation(p, b, c), 0);
      EXPECT_EQ(in_circle(a, b, c, p), 0);
    }
  }
}

struct Complex {
  Rational re = 0;
  Rational im = 0;
  bool is_zero() const { return re == 0 && im == 0; }
};
Complex operator*(const Complex& a, const Complex& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
Complex operator-(const Complex& a, const Complex& b) { return {a.re - b.re, a.im - b.im}; }
Complex operator/(const Complex& a, const Complex& b) {
  const Rational n = b.re * b.re + b.im * b.im;
  const Complex product = a * Complex{b.re, -b.im};
  return {product.re / n, product.im / n};
}

// Rank by Gauss in rationals, dense.
Index rank(Index unknowns, const std::vector<LinearForm>& rows) {
  std::vector<std::vector<Complex>> matrix;
  for (const LinearForm& row : rows) {
    matrix.emplace_back(at(unknowns));
    for (const Term& t : row) {
      matrix.back()[at(t.unknown)].re += static_cast<long>(t.factor.re);
      matrix.back()[at(t.unknown)].im += static_cast<long>(t.factor.im);
    }
  }
  std::size_t found = 0;
  for (std::size_t c = 0; c < at(unknowns) && found < matrix.size(); ++c) {
    std::size_t p = found;
    while (p < matrix.size() && matrix[p][c].is_zero()) ++p;
    if (p == matrix.size()) continue;
    std::swap(matrix[p], matrix[found]);
    for (std::size_t r = found + 1; r < matrix.size(); ++r) {
      const Complex f = matrix[r][c] / matrix[found][c];
      for (std::size_t k = c; k < at(unknowns); ++k)
        matrix[r][k] = matrix[r][k] - f * matrix[found][k];
    }
    ++found;
  }
  return static_cast<Index>(found);
}

// Do the values make every row zero, whatever the free unknowns are?
bool solves(const Elimination& e, const std::vector<LinearForm>& rows) {
  for (const LinearForm& row : rows) {
    std::vector<Complex> total(e.value.size());
    for (const Term& t : row) {
      const Elimination::Value& v = e.value[at(t.unknown)];
      for (const Term& f : v.form) {
        const GaussianInteger product = t.factor * f.factor;
        total[at(f.unknown)].re += Rational(product.re) / v.divisor;
        total[at(f.unknown)].im += Rational(product.im) / v.divisor;
      }
    }
    for (const Complex& c : total) {
      if (!c.is_zero()) return false;
    }
  }
  return true;
}

Index free_count(const Elimination& e) {
  Index count = 0;
  for (const char f : e.free) count += f;
  return count;
}

void expect_solution(Index unknowns, const std::vector<LinearForm>& rows) {
  const auto e = eliminate(unknowns, rows, ExecutionContext());
  ASSERT_TRUE(e.has_value());
  ASSERT_EQ(e->value.size(), at(unknowns));
  EXPECT_TRUE(solves(*e, rows));
  EXPECT_EQ(free_count(*e), unknowns - rank(unknowns, rows));
  for (Index u = 0; u < unknowns; ++u) {
    const Elimination::Value& v = e->value[at(u)];
    EXPECT_GT(v.divisor, 0);
    for (const Term& t : v.form) EXPECT_TRUE(e->free[at(t.unknown)]);
    if (e->free[at(u)]) {
      ASSERT_EQ(v.form.size(), 1U);
      EXPECT_EQ(v.form[0].unknown, u);
      EXPECT_EQ(v.form[0].factor, (GaussianInteger{1, 0}));
    }
  }
}

std::vector<LinearForm> random_rows(std::mt19937& random, Index unknowns, int rows, int terms,
                                    int largest, bool gaussian) {
  std::uniform_int_distribution<Index> pick(0, unknowns - 1);
  std::uniform_int_distribution<int> factor(-largest, largest);
  std::vector<LinearForm> out(static_cast<std::size_t>(rows));
  for (LinearForm& row : out) {
    for (int t = 0; t < terms; ++t)
      row.push_back({pick(random), {factor(random), gaussian ? factor(random) : 0}});
  }
  return out;
}

TEST(ExactElimination, agrees_with_rational_gauss_on_random_systems) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 800; ++trial) {
    const Index unknowns = 2 + trial % 9;
    expect_solution(unknowns,
                    random_rows(random, unknowns, 1 + trial % 7, 1 + trial % 4, 3, trial < 400));
  }
}

TEST(ExactElimination, systems_of_units_on_trees_have_values_without_divisors) {
  // Closures of a random tree's inner nodes: every edge of the tree is an unknown.
  std::mt19937 random(9);
  for (int trial = 0; trial < 50; ++trial) {
    const Index nodes = 30;
    std::vector<LinearForm> rows(at(nodes));
    for (Index v = 1; v < nodes; ++v) {
      const Index parent = std::uniform_int_distribution<Index>(0, v - 1)(random);
      const Index turns = std::uniform_int_distribution<Index>(0, 3)(random);
      rows[at(v)].push_back({v - 1, {1, 0}});
      rows[at(parent)].push_back({v - 1, quarter_turn(turns)});
    }
    std::erase_if(rows, [](const LinearForm& row) { return row.size() < 2; });  // leaves are cones
    const auto e = eliminate(nodes - 1, rows, ExecutionContext());
    ASSERT_TRUE(e.has_value());
    EXPECT_TRUE(solves(*e, rows));
    for (const auto& v : e->value) EXPECT_EQ(v.divisor, 1);
  }
}

TEST(ExactElimination, a_division_by_one_minus_i_is_told) {
  // (1 - i) x = y + 2 i z and no unit but y's: y is eliminated. Without units, x is divided.
  const auto with_unit =
      eliminate(3, {{{0, {1, -1}}, {1, {-1, 0}}, {2, {0, -2}}}}, ExecutionContext());
  ASSERT_TRUE(with_unit.has_value());
  EXPECT_FALSE(with_unit->free[1]);
  EXPECT_EQ(with_unit->value[1].divisor, 1);
  const auto without = eliminate(2, {{{0, {1, -1}}, {1, {3, 0}}}}, ExecutionContext());
  ASSERT_TRUE(without.has_value());
  EXPECT_FALSE(without->free[0]);
  EXPECT_EQ(without->value[0].divisor, 2);  // -3 / (1 - i) = -3 (1 + i) / 2
}

TEST(ExactElimination, numbers_beyond_64_bits_are_refused_not_wrapped) {
  std::vector<LinearForm> rows;
  for (Index i = 0; i + 1 < 20; ++i)
    rows.push_back({{i, {1'000'003 + i, 0}}, {i + 1, {999'983 - i, 0}}});
  EXPECT_FALSE(eliminate(20, rows, ExecutionContext()).has_value());
}

}  // namespace
}  // namespace flipfree::numeric::exact_test
