#include "flipfree/seamless/padding/geometry/equalize.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::seamless {
namespace {

// Lengths are equal if they differ by less than this share of the longest one; every refinement
// gains some 45 bits of it.
constexpr int kEqualBits = 160;
// What rounding of the metric may leave where rows depend on each other: in the fourfold case
// lengths that cannot be changed alone are equal by themselves.
constexpr double kLeftOver = 1e-6;
// A width below this share of the longest segment is none.
constexpr double kNoWidth = 1e-5;

double logarithm(const Wide& value) {
  std::int64_t exponent = 0;
  const double mantissa = value.to_double_scaled(exponent);
  return std::log(mantissa) + std::numbers::ln2 * static_cast<double>(exponent);
}

Wide mates_length(const EqualizationRow& row, const std::vector<Wide>& length) {
  Wide sum(0.0);
  for (const Index mate : row.mates) sum += length[at(mate)];
  return sum;
}

// b - A w of a row.
Wide lacking(const EqualizationRow& row, const std::vector<Wide>& length,
             const std::vector<Wide>& width) {
  Wide rest = mates_length(row, length) - length[at(row.segment)];
  for (const auto& [segment, coefficient] : row.terms)
    rest -= Wide(static_cast<double>(coefficient)) * width[at(segment)];
  return rest;
}

}  // namespace

std::vector<double> component_scales(const CutSegments& segments, const EqualizationSystem& system,
                                     const std::vector<Wide>& length) {
  const auto count = static_cast<Eigen::Index>(segments.component_count());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  // The first component keeps its scale; rows weigh much more than what makes the rest definite.
  constexpr double kWeight = 1e6;
  normal(0, 0) = 1e12;
  for (const EqualizationRow& row : system.rows) {
    const Index a = segments.segments[at(row.segment)].component;
    const Index b = segments.segments[at(row.mates.front())].component;
    if (a == b) continue;
    const double wish =
        kWeight * (logarithm(mates_length(row, length)) - logarithm(length[at(row.segment)]));
    normal(a, a) += kWeight;
    normal(b, b) += kWeight;
    normal(a, b) -= kWeight;
    normal(b, a) -= kWeight;
    right[a] += wish;
    right[b] -= wish;
  }
  const Eigen::VectorXd logarithms = numeric::solve_symmetric(normal, right);
  std::vector<double> scale;
  for (Eigen::Index i = 0; i < count; ++i) scale.push_back(std::exp(logarithms[i]));
  return scale;
}

namespace {

// A with the columns of some segments only, and what is needed to solve A w = b for these.
class Widths {
 public:
  Widths(const EqualizationSystem& system, const std::vector<Wide>& length)
      : system_(system),
        length_(length),
        a_(Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(system.rows.size()), system.unknowns)) {
    for (Eigen::Index r = 0; r < a_.rows(); ++r) {
      for (const auto& [segment, coefficient] : system.rows[static_cast<std::size_t>(r)].terms)
        a_(r, segment) += coefficient;
    }
    for (const Wide& l : length) largest_ = std::max(largest_, l);
    padded_.assign(at(system.unknowns), 1);
    for (const Index s : system.unpadded) padded_[at(s)] = 0;
  }

  const std::vector<char>& padded() const { return padded_; }
  const Wide& largest() const { return largest_; }

  // The nearest solution to `width` that changes the segments in `use` alone, in the precision of
  // the lengths; `left_over`: what may be missing, over the longest segment. False if there is
  // none.
  bool solve(const std::vector<char>& use, double left_over, std::vector<Wide>& width) const {
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(columns(use));
    Wide before = Wide(2.0 * static_cast<double>(length_.size()) + 2.0) * largest_;
    for (;;) {
      Wide most(0.0);
      const std::vector<Wide> rest = lacking_all(width, most);
      if (most <= Wide(std::ldexp(1.0, -kEqualBits)) * largest_) return true;
      if (most > Wide(0.5) * before) return most <= Wide(left_over) * largest_;
      before = most;
      const Eigen::VectorXd step = solver.solve(relative(rest, most));
      for (Index s = 0; s < system_.unknowns; ++s) {
        if (use[at(s)]) width[at(s)] += most * Wide(step[s]);
      }
    }
  }

  // The non-negative solution of least norm, nearly: Dykstra's alternating projections. Over the
  // longest segment.
  Eigen::VectorXd least() const {
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(columns(padded_));
    Wide most(0.0);
    const std::vector<Wide> none(at(system_.unknowns), Wide(0.0));
    const Eigen::VectorXd b = relative(lacking_all(none, most), largest_);
    const Eigen::MatrixXd inverse = solver.pseudoInverse();
    Eigen::VectorXd w = Eigen::VectorXd::Zero(system_.unknowns), excess = w;
    for (int i = 0; i < kProjections; ++i) {
      w += inverse * (b - a_ * w);
      const Eigen::VectorXd sum = w + excess;
      const Eigen::VectorXd next = sum.cwiseMax(0.0);
      excess = sum - next;
      w = next;
    }
    return w;
  }

 private:
  static constexpr int kProjections = 2000;

  Eigen::MatrixXd columns(const std::vector<char>& use) const {
    Eigen::MatrixXd a = a_;
    for (Index s = 0; s < system_.unknowns; ++s) {
      if (!use[at(s)]) a.col(s).setZero();
    }
    return a;
  }
  std::vector<Wide> lacking_all(const std::vector<Wide>& width, Wide& most) const {
    std::vector<Wide> rest;
    for (const EqualizationRow& row : system_.rows) {
      rest.push_back(lacking(row, length_, width));
      most = std::max(most, abs(rest.back()));
    }
    return rest;
  }
  static Eigen::VectorXd relative(const std::vector<Wide>& values, const Wide& unit) {
    Eigen::VectorXd out(static_cast<Eigen::Index>(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i)
      out[static_cast<Eigen::Index>(i)] = numeric::ratio(values[i], unit);
    return out;
  }

  const EqualizationSystem& system_;
  const std::vector<Wide>& length_;
  Eigen::MatrixXd a_;
  Wide largest_{0.0};
  std::vector<char> padded_;
};

bool none_negative(const std::vector<Wide>& width) {
  return std::all_of(width.begin(), width.end(), [](const Wide& w) { return w.sign() >= 0; });
}

}  // namespace

std::vector<Wide> padding_widths(const EqualizationSystem& system,
                                 const std::vector<Wide>& length) {
  const Widths widths(system, length);
  const std::vector<Wide> zero(at(system.unknowns), Wide(0.0, kWideBits));
  // Small widths first.
  const Eigen::VectorXd least = widths.least();
  std::vector<char> use(zero.size(), 0);
  std::vector<Wide> width = zero;
  for (std::size_t s = 0; s < use.size(); ++s) {
    const double w = least[static_cast<Eigen::Index>(s)];
    use[s] = widths.padded()[s] && w > kNoWidth;
    if (use[s]) width[s] = Wide(w) * widths.largest();
  }
  if (widths.solve(use, 0.0, width) && none_negative(width)) return width;
  // What always works: a solution, and the same number added to all.
  width = zero;
  if (!widths.solve(widths.padded(), kLeftOver, width))
    throw InternalError("padding: the equalization system has no solution");
  Wide smallest(0.0);
  for (std::size_t s = 0; s < width.size(); ++s) {
    if (widths.padded()[s]) smallest = std::min(smallest, width[s]);
  }
  for (std::size_t s = 0; s < width.size(); ++s) {
    if (widths.padded()[s]) width[s] -= smallest;
  }
  return width;
}

std::vector<Wide> padded_lengths(const CutSegments& segments, const std::vector<Wide>& length,
                                 const std::vector<Wide>& width) {
  std::vector<Wide> padded;
  for (std::size_t s = 0; s < length.size(); ++s) {
    const auto i = static_cast<Index>(s);
    padded.push_back(width[at(segments.previous(i))] + length[s] + width[at(segments.next(i))]);
  }
  return padded;
}

}  // namespace flipfree::seamless
