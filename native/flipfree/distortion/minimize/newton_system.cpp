#include "flipfree/distortion/minimize/newton_system.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/parallel.h"
#include "flipfree/distortion/energy/energy.h"

namespace flipfree::distortion {
namespace {

// Relative raise of the diagonal. A free map may be moved and turned at no cost, so the system is
// singular (or nearly) without it; far below the softest real mode, which is about 1 / #V of the
// diagonal.
constexpr double kLeastDamping = 1e-10;
constexpr double kMostDamping = 1e-2;

}  // namespace

FaceEnergy symmetric_dirichlet_energy(const Triangles& faces, const std::vector<RestTriangle>& rest,
                                      const Points2& uv, bool soft) {
  return [&faces, &rest, &uv, soft](std::size_t f, double* gradient, double* hessian) {
    const Jacobian j = jacobian(rest[f], faces, f, uv);
    return rest[f].weight * symmetric_dirichlet_derivatives(rest[f], j, gradient, hessian, soft);
  };
}

NewtonSystem::NewtonSystem(const Triangles& faces, const std::vector<char>& fixed,
                           const std::vector<std::array<VertexId, 2>>& couplings,
                           ExecutionContext& context)
    : faces_(faces), number_of_(fixed.size(), kInvalid) {
  std::vector<char> used(fixed.size(), 0);
  for (Eigen::Index i = 0; i < faces.size(); ++i) used[at(faces.data()[i])] = 1;
  for (const auto& [v, w] : couplings) used[at(v)] = used[at(w)] = 1;
  for (std::size_t v = 0; v < fixed.size(); ++v) {
    if (fixed[v] || !used[v]) continue;
    number_of_[v] = static_cast<Index>(vertex_of_.size());
    vertex_of_.push_back(static_cast<VertexId>(v));
  }
  context.check();
  build_pattern(couplings, context);
  context.check();
  face_gradient_.resize(6 * at(faces.rows()));
  face_hessian_.resize(kHessianEntries * at(faces.rows()));
  if (!all_fixed()) cholesky_.analyze(matrix_, context);
}

void NewtonSystem::build_pattern(const std::vector<std::array<VertexId, 2>>& couplings,
                                 const ExecutionContext& context) {
  // Blocks below the diagonal as pairs of free numbers, the column's first.
  std::vector<std::array<Index, 2>> blocks;
  const auto couple = [&](VertexId v, VertexId w) {
    const auto [low, high] = std::minmax(number_of_[at(v)], number_of_[at(w)]);
    if (low != kInvalid && low != high) blocks.push_back({low, high});
  };
  for (CornerId c = 0; c < static_cast<CornerId>(faces_.size()); ++c)
    couple(faces_.data()[c], faces_.data()[next_corner(c)]);
  for (const auto& [v, w] : couplings) couple(v, w);
  context.check();
  sort_unique(blocks);
  context.check();
  const auto unknowns = static_cast<Index>(2 * vertex_of_.size());
  matrix_.resize(unknowns, unknowns);
  Index* column = matrix_.outerIndexPtr();
  std::vector<Index> rows;
  auto first = blocks.begin();
  for (Index i = 0; i < unknowns; i += 2) {
    auto last = first;
    while (last != blocks.end() && 2 * (*last)[0] == i) ++last;
    for (Index axis = 0; axis < 2; ++axis) {
      for (Index a = axis; a < 2; ++a) rows.push_back(i + a);
      for (auto block = first; block != last; ++block) {
        rows.push_back(2 * (*block)[1]);
        rows.push_back(2 * (*block)[1] + 1);
      }
      *++column = static_cast<Index>(rows.size());
    }
    first = last;
  }
  matrix_.resizeNonZeros(static_cast<Index>(rows.size()));
  std::copy(rows.begin(), rows.end(), matrix_.innerIndexPtr());
  diagonal_.resize(at(unknowns));
  for (CornerId c = 0; c < static_cast<CornerId>(faces_.size()); ++c)
    place_.push_back(place_of(faces_.data()[c], faces_.data()[next_corner(c)]));
}

double StepSystem::assemble(const FaceEnergy& of_face, ExecutionContext& context) {
  return do_assemble(of_face, context);
}

double StepSystem::solve(Points2& direction, ExecutionContext& context) {
  return do_solve(direction, context);
}

double NewtonSystem::do_assemble(const FaceEnergy& of_face, ExecutionContext& context) {
  const std::size_t count = at(faces_.rows());
  const double energy = sum_of(context, count, kGrain, [&](std::size_t f) {
    return of_face(f, &face_gradient_[6 * f], &face_hessian_[kHessianEntries * f]);
  });
  gradient_ = Eigen::VectorXd::Zero(matrix_.rows());
  std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
  for (std::size_t c = 0; c < 3 * count; ++c) {
    if (c % 8192 == 0) context.check();
    add(faces_.data()[c], &face_gradient_[2 * c],
        &face_hessian_[kHessianEntries * (c / 3) + 3 * (c % 3)]);
  }
  for (std::size_t c = 0; c < 3 * count; ++c) {
    if (c % 8192 == 0) context.check();
    const double* block = &face_hessian_[kHessianEntries * (c / 3) + 9 + 4 * (c % 3)];
    add_at(place_[c], faces_.data()[c], faces_.data()[next_corner(static_cast<CornerId>(c))],
           block);
  }
  return energy;
}

void NewtonSystem::add(VertexId v, const double gradient[2], const double block[3]) {
  const Index i = number_of_[at(v)];
  if (i == kInvalid) return;
  gradient_[2 * i] += gradient[0];
  gradient_[2 * i + 1] += gradient[1];
  double* values = matrix_.valuePtr();
  const Index* column = matrix_.outerIndexPtr() + 2 * i;
  values[column[0]] += block[0];
  values[column[0] + 1] += block[1];
  values[column[1]] += block[2];
}

Index NewtonSystem::place_of(VertexId v, VertexId w) const {
  const auto [low, high] = std::minmax(number_of_[at(v)], number_of_[at(w)]);
  if (low == kInvalid) return kInvalid;
  const Index* column = matrix_.outerIndexPtr() + 2 * low;
  const Index* begin = matrix_.innerIndexPtr() + column[0];
  const Index* end = matrix_.innerIndexPtr() + column[1];
  const Index* found = std::lower_bound(begin, end, 2 * high);
  return found == end || *found != 2 * high ? kInvalid : static_cast<Index>(found - begin);
}

bool NewtonSystem::add_block(VertexId v, VertexId w, const double block[4]) {
  const Index place = place_of(v, w);
  if (place == kInvalid && number_of_[at(v)] != kInvalid && number_of_[at(w)] != kInvalid)
    return false;
  add_at(place, v, w, block);
  return true;
}

void NewtonSystem::add_at(Index place, VertexId v, VertexId w, const double block[4]) {
  const Index i = number_of_[at(v)], j = number_of_[at(w)];
  const auto [low, high] = std::minmax(i, j);
  if (low == kInvalid) {
    if (high == kInvalid || motion_.rows() == 0) return;
    const Vector2 by = motion_.row(i == kInvalid ? v : w);
    gradient_[2 * high] += block[0] * by.x() + block[i == kInvalid ? 2 : 1] * by.y();
    gradient_[2 * high + 1] += block[i == kInvalid ? 1 : 2] * by.x() + block[3] * by.y();
    return;
  }
  const bool ordered = i == low;
  const Index* column = matrix_.outerIndexPtr() + 2 * low;
  double* first = matrix_.valuePtr() + column[0] + place;
  double* second = matrix_.valuePtr() + column[1] + place - 1;
  first[0] += block[0];
  first[1] += block[ordered ? 1 : 2];
  second[0] += block[ordered ? 2 : 1];
  second[1] += block[3];
}

double NewtonSystem::do_solve(Points2& direction, ExecutionContext& context) {
  direction.setZero(static_cast<Eigen::Index>(number_of_.size()), 2);
  if (motion_.rows() > 0) direction += motion_;
  if (all_fixed()) return 0;
  const Index* column = matrix_.outerIndexPtr();
  double* values = matrix_.valuePtr();
  for (std::size_t i = 0; i < diagonal_.size(); ++i) diagonal_[i] = values[column[i]];
  damping_ = std::max(kLeastDamping, 0.1 * damping_);
  for (;; damping_ *= 100) {
    if (damping_ > kMostDamping) {
      throw_not_converged(ErrorCode::kFactorizationFailed,
                          "The Newton system could not be factorized: the surface or the map has "
                          "triangles that are "
                          "too small or too thin. Merge vertices that nearly coincide (Merge by "
                          "Distance), dissolve "
                          "slivers (Degenerate Dissolve), or move pins apart.");
    }
    for (std::size_t i = 0; i < diagonal_.size(); ++i)
      values[column[i]] = diagonal_[i] * (1.0 + damping_);
    if (cholesky_.factorize(matrix_, context)) break;
  }
  const Eigen::MatrixXd x = cholesky_.solve(-gradient_, context);
  double product = 0;
  for (std::size_t i = 0; i < vertex_of_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 * i);
    direction(vertex_of_[i], 0) = x(row);
    direction(vertex_of_[i], 1) = x(row + 1);
    product += x(row) * gradient_(row) + x(row + 1) * gradient_(row + 1);
  }
  return product;
}

}  // namespace flipfree::distortion
