#include "flipfree/numeric/exact_elimination.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <random>

namespace flipfree::numeric::exact_elimination_test {
namespace {

using Rational = mpq_class;
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
        total[at(f.unknown)].re +=
            Rational(static_cast<long>(product.re), static_cast<unsigned long>(v.divisor));
        total[at(f.unknown)].im +=
            Rational(static_cast<long>(product.im), static_cast<unsigned long>(v.divisor));
      }
    }
    for (Complex& c : total) {
      c.re.canonicalize();
      c.im.canonicalize();
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
}  // namespace flipfree::numeric::exact_elimination_test
