#include "flipfree/field/prescribed/relax.h"

#include <gtest/gtest.h>

#include "field/fields.h"

namespace flipfree::field::relax_test {
namespace {

double energy(const AngleSystem& system, const std::vector<double>& rotation) {
  double sum = 0.0;
  for (std::size_t h = 0; h < rotation.size(); ++h)
    sum += 0.5 * system.weight()[h] * rotation[h] * rotation[h];
  return sum;
}

TEST(RelaxTest, LeavesTheMatchingAndIsAMinimum) {
  for (const Place& p : places()) {
    ExecutionContext context;
    std::vector<char> held(p.faces(), 0);
    held[1] = 1;
    const AngleSystem system(p.surface, p.adjacency, held, std::vector<double>(p.faces(), 0.0),
                             context);
    CrossField field = p.random_field(3);
    const CrossField before = field;
    relax(p.adjacency, p.frames, system, field, context);
    EXPECT_EQ(field.matching, before.matching);
    EXPECT_EQ(field.angle[1], before.angle[1]);
    const double least = energy(system, rotation_form(p.adjacency, p.frames, field));
    for (std::size_t f = 0; f < p.faces(); f += 5) {
      CrossField other = field;
      other.angle[f] += 0.01;
      EXPECT_GE(energy(system, rotation_form(p.adjacency, p.frames, other)),
                least - (f == 1 ? 1.0 : 0.0));
    }
  }
}

TEST(RelaxTest, DescendingNeverNeedsMoreRotation) {
  for (const Place& p : places()) {
    ExecutionContext context;
    const AngleSystem system(p.surface, p.adjacency, std::vector<char>(p.faces(), 0),
                             std::vector<double>(p.faces(), 0.0), context);
    CrossField field = p.random_field(4);
    const double before = energy(system, rotation_form(p.adjacency, p.frames, field));
    descend(p.adjacency, p.frames, system, std::vector<double>(p.faces(), 0.0), field, context);
    const double after = energy(system, rotation_form(p.adjacency, p.frames, field));
    EXPECT_LT(after, 0.8 * before);
    for (const double r : rotation_form(p.adjacency, p.frames, field))
      EXPECT_LE(std::abs(r), 0.5 * kTestQuarter + 1e-9);
  }
}

TEST(RelaxTest, HeavyWishesAreMetByOneOfTheFourDirections) {
  const Place p(test::torus(12, 8));
  ExecutionContext context;
  const CrossField start = p.random_field(5);
  std::vector<double> wish(p.faces(), 0.4);
  const AngleSystem system(p.surface, p.adjacency, std::vector<char>(p.faces(), 0),
                           std::vector<double>(p.faces(), 1e9), context);
  CrossField field = start;
  descend(p.adjacency, p.frames, system, wish, field, context);
  for (const double a : field.angle) EXPECT_NEAR(std::remainder(a - 0.4, kTestQuarter), 0.0, 1e-6);
}

}  // namespace
}  // namespace flipfree::field::relax_test
