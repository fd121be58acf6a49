#include "flipfree/numeric/exact_elimination.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <utility>

namespace flipfree::numeric {
namespace {

using Integer = std::int64_t;

// Thrown inside this file only.
struct Overflow {};

Integer times(Integer a, Integer b) {
  Integer product = 0;
  if (__builtin_mul_overflow(a, b, &product)) throw Overflow{};
  return product;
}
Integer plus(Integer a, Integer b) {
  Integer result = 0;
  if (__builtin_add_overflow(a, b, &result)) throw Overflow{};
  return result;
}
Integer minus(Integer a, Integer b) {
  Integer result = 0;
  if (__builtin_sub_overflow(a, b, &result)) throw Overflow{};
  return result;
}
GaussianInteger times(const GaussianInteger& a, const GaussianInteger& b) {
  return {minus(times(a.re, b.re), times(a.im, b.im)), plus(times(a.re, b.im), times(a.im, b.re))};
}
GaussianInteger negative(const GaussianInteger& a) { return {minus(0, a.re), minus(0, a.im)}; }
Integer norm(const GaussianInteger& a) { return plus(times(a.re, a.re), times(a.im, a.im)); }

// Nearest integer to a / b, b > 0.
Integer rounded_quotient(Integer a, Integer b) {
  Integer quotient = a / b;
  const Integer rest = a - quotient * b;
  if (rest > b / 2) ++quotient;
  if (rest < -(b / 2)) --quotient;
  return quotient;
}

// Nearest Gaussian integer to a / b; the quotient itself if there is one.
GaussianInteger quotient(const GaussianInteger& a, const GaussianInteger& b) {
  const GaussianInteger product = times(a, {b.re, minus(0, b.im)});
  const Integer n = norm(b);
  return {rounded_quotient(product.re, n), rounded_quotient(product.im, n)};
}

// Greatest common divisor (Euclid), up to a unit.
GaussianInteger divisor(GaussianInteger a, GaussianInteger b) {
  while (!b.is_zero()) {
    const GaussianInteger whole = times(quotient(a, b), b);
    a = {minus(a.re, whole.re), minus(a.im, whole.im)};
    std::swap(a, b);
  }
  return a;
}

LinearForm checked_sum(const GaussianInteger& p, const LinearForm& a, const GaussianInteger& q,
                       const LinearForm& b) {
  LinearForm out;
  out.reserve(a.size() + b.size());
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() || j < b.size()) {
    const bool left = j == b.size() || (i < a.size() && a[i].unknown <= b[j].unknown);
    const bool right = i == a.size() || (j < b.size() && b[j].unknown <= a[i].unknown);
    Term term{left ? a[i].unknown : b[j].unknown, {}};
    if (left) term.factor = times(p, a[i++].factor);
    if (right) {
      const GaussianInteger other = times(q, b[j++].factor);
      term.factor = {plus(term.factor.re, other.re), plus(term.factor.im, other.im)};
    }
    if (!term.factor.is_zero()) out.push_back(term);
  }
  return out;
}

// Divided by what all factors have in common, unless that is a unit.
void reduce(LinearForm& row) {
  GaussianInteger common;
  for (const Term& t : row) {
    common = divisor(common, t.factor);
    if (common.is_unit()) return;
  }
  for (Term& t : row) t.factor = quotient(t.factor, common);
}

const Term* find(const LinearForm& row, Index unknown) {
  const auto at = std::lower_bound(row.begin(), row.end(), unknown,
                                   [](const Term& t, Index u) { return t.unknown < u; });
  return at != row.end() && at->unknown == unknown ? &*at : nullptr;
}

class Solver {
 public:
  Solver(Index unknowns, const std::vector<LinearForm>& rows, const ExecutionContext& context)
      : context_(context), rows_(rows), rows_of_(at(unknowns)) {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      normalise(rows_[r]);
      reduce(rows_[r]);
      enter(static_cast<Index>(r));
    }
  }

  Elimination solve() {
    std::vector<std::pair<Index, Index>> pivots;  // row, unknown
    while (!waiting_.empty()) {
      context_.check();
      const Index row = (*waiting_.begin())[2];
      const Index unknown = pivot_of(rows_[at(row)]);
      leave(row);
      clear(row, unknown);
      pivots.emplace_back(row, unknown);
    }
    Elimination out;
    out.value.resize(rows_of_.size());
    out.free.assign(rows_of_.size(), 1);
    for (const auto& [row, unknown] : pivots) out.free[at(unknown)] = 0;
    for (std::size_t u = 0; u < rows_of_.size(); ++u)
      out.value[u].form = {{static_cast<Index>(u), {1, 0}}};
    // A pivot's row has no earlier pivots.
    for (auto p = pivots.rbegin(); p != pivots.rend(); ++p) {
      context_.check();
      out.value[at(p->second)] = value_of(rows_[at(p->first)], p->second, out.value);
    }
    return out;
  }

 private:
  // Rows in the order in which they are taken: with a unit first, then short ones.
  std::array<Index, 3> rank(Index row) const {
    const LinearForm& form = rows_[at(row)];
    const bool unit =
        std::any_of(form.begin(), form.end(), [](const Term& t) { return t.factor.is_unit(); });
    return {unit ? 0 : 1, static_cast<Index>(form.size()), row};
  }
  void enter(Index row) {
    if (rows_[at(row)].empty()) return;
    waiting_.insert(rank(row));
    for (const Term& t : rows_[at(row)]) rows_of_[at(t.unknown)].insert(row);
  }
  void leave(Index row) {
    waiting_.erase(rank(row));
    for (const Term& t : rows_[at(row)]) rows_of_[at(t.unknown)].erase(row);
  }

  // A unit if there is one, else the least factor; then the unknown in the fewest rows.
  Index pivot_of(const LinearForm& row) const {
    Index best = kInvalid;
    std::pair<Integer, std::size_t> least;
    for (const Term& t : row) {
      const std::pair<Integer, std::size_t> cost{norm(t.factor), rows_of_[at(t.unknown)].size()};
      if (best == kInvalid || cost < least) {
        best = t.unknown;
        least = cost;
      }
    }
    return best;
  }

  // Takes `unknown` out of all rows that wait, by means of `row`.
  void clear(Index row, Index unknown) {
    const LinearForm& pivot = rows_[at(row)];
    const GaussianInteger a = find(pivot, unknown)->factor;
    const std::vector<Index> others(rows_of_[at(unknown)].begin(), rows_of_[at(unknown)].end());
    for (const Index other : others) {
      leave(other);
      LinearForm& form = rows_[at(other)];
      const GaussianInteger b = find(form, unknown)->factor;
      const GaussianInteger g = divisor(a, b);
      form = checked_sum(quotient(a, g), form, negative(quotient(b, g)), pivot);
      reduce(form);
      enter(other);
    }
  }

  // unknown = -(the other terms) / its factor, with the values of these.
  static Elimination::Value value_of(const LinearForm& row, Index unknown,
                                     const std::vector<Elimination::Value>& values) {
    GaussianInteger own;
    Integer common = 1;
    for (const Term& t : row) {
      if (t.unknown == unknown) {
        own = t.factor;
      } else {
        const Integer d = values[at(t.unknown)].divisor;
        common = times(common / std::gcd(common, d), d);
      }
    }
    Elimination::Value out;
    for (const Term& t : row) {
      if (t.unknown == unknown) continue;
      const Elimination::Value& v = values[at(t.unknown)];
      out.form = checked_sum({1, 0}, out.form, times(t.factor, {common / v.divisor, 0}), v.form);
    }
    // Divided by `own` times `common`: the conjugate makes the divisor an ordinary integer.
    const GaussianInteger conjugate{minus(0, own.re), own.im};
    out.divisor = times(common, norm(own));
    Integer shared = out.divisor;
    for (Term& t : out.form) {
      t.factor = times(t.factor, conjugate);
      shared = std::gcd(shared, std::gcd(t.factor.re, t.factor.im));
    }
    for (Term& t : out.form) t.factor = {t.factor.re / shared, t.factor.im / shared};
    out.divisor /= shared;
    return out;
  }

  const ExecutionContext& context_;
  std::vector<LinearForm> rows_;
  std::vector<std::set<Index>> rows_of_;  // unknown -> rows that wait
  std::set<std::array<Index, 3>> waiting_;
};

}  // namespace

void normalise(LinearForm& form) {
  std::sort(form.begin(), form.end(),
            [](const Term& a, const Term& b) { return a.unknown < b.unknown; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < form.size();) {
    Term total{form[i].unknown, {}};
    for (; i < form.size() && form[i].unknown == total.unknown; ++i)
      total.factor = total.factor + form[i].factor;
    if (!total.factor.is_zero()) form[kept++] = total;
  }
  form.resize(kept);
}

std::optional<LinearForm> sum(const LinearForm& form, const GaussianInteger& factor,
                              const LinearForm& other) try {
  return checked_sum({1, 0}, form, factor, other);
} catch (const Overflow&) {
  return std::nullopt;
}

std::optional<Elimination> eliminate(Index unknowns, const std::vector<LinearForm>& rows,
                                     const ExecutionContext& context) try {
  return Solver(unknowns, rows, context).solve();
} catch (const Overflow&) {
  return std::nullopt;
}

}  // namespace flipfree::numeric
