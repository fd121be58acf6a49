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

constexpr std::size_t kVertexGrain = 4096;
// Relative raise of the diagonal. A free map may be moved and turned at no cost, so the system is
// singular (or nearly) without it; far below the softest real mode, which is about 1 / #V of the
// diagonal.
constexpr double kLeastDamping = 1e-10;
constexpr double kMostDamping = 1e-2;

}  // namespace

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
  build_pattern(faces, couplings, context);
  context.check();
  face_gradient_.resize(6 * at(faces.rows()));
  face_hessian_.resize(kHessianEntries * at(faces.rows()));
  gradient_.resize(2 * vertex_of_.size());
  if (!vertex_of_.empty()) cholesky_.analyze(matrix_, context);
}

void NewtonSystem::build_pattern(const Triangles& faces,
                                 const std::vector<std::array<VertexId, 2>>& couplings,
                                 const ExecutionContext& context) {
  const std::size_t count = vertex_of_.size();
  corners_ = Lists<CornerId>(count, [&](const auto& add) {
    for (CornerId c = 0; c < static_cast<CornerId>(faces.size()); ++c) {
      const Index i = number_of_[at(faces.data()[c])];
      if (i != kInvalid) add(i, c);
    }
  });

  std::vector<std::array<Index, 2>> extra;  // couplings as free numbers, lower first
  for (const auto& [v, w] : couplings) {
    const auto [low, high] = std::minmax(number_of_[at(v)], number_of_[at(w)]);
    if (low != kInvalid && low != high) extra.push_back({low, high});
  }
  std::sort(extra.begin(), extra.end());
  auto next_extra = extra.begin();

  // Column of block i: its diagonal block, then its neighbours j > i ascending.
  slot_.assign(at(faces.size()), kInvalid);
  const auto unknowns = static_cast<Index>(2 * count);
  matrix_.resize(unknowns, unknowns);
  Index* column = matrix_.outerIndexPtr();
  std::vector<Index> rows;
  std::vector<Index> below;
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 8192 == 0) context.check();
    below.clear();
    const auto number = static_cast<Index>(i);
    const auto other = [&](CornerId c) { return number_of_[at(faces.data()[c])]; };
    for (const CornerId c : corners_[number]) {
      for (const CornerId neighbour : {next_corner(c), previous_corner(c)}) {
        if (other(neighbour) > number) below.push_back(other(neighbour));
      }
    }
    for (; next_extra != extra.end() && (*next_extra)[0] == number; ++next_extra) {
      below.push_back((*next_extra)[1]);
    }
    sort_unique(below);
    const auto place = [&](Index j) {
      return static_cast<Index>(std::lower_bound(below.begin(), below.end(), j) - below.begin());
    };
    for (const CornerId c : corners_[number]) {
      if (other(next_corner(c)) > number) slot_[at(c)] = place(other(next_corner(c)));
      if (other(previous_corner(c)) > number)
        slot_[at(previous_corner(c))] = place(other(previous_corner(c)));
    }
    for (int axis = 0; axis < 2; ++axis) {
      for (int a = axis; a < 2; ++a) rows.push_back(2 * number + a);
      for (const Index j : below) {
        rows.push_back(2 * j);
        rows.push_back(2 * j + 1);
      }
      *++column = static_cast<Index>(rows.size());
    }
  }
  matrix_.resizeNonZeros(static_cast<Index>(rows.size()));
  std::copy(rows.begin(), rows.end(), matrix_.innerIndexPtr());
  diagonal_.resize(at(unknowns));
}

double NewtonSystem::assemble(const std::vector<RestTriangle>& rest, const Points2& uv, bool soft,
                              ExecutionContext& context) {
  const auto of_face = [&](std::size_t f, double* gradient, double* hessian) {
    const Jacobian j = jacobian(rest[f], faces_, f, uv);
    return rest[f].weight * symmetric_dirichlet_derivatives(rest[f], j, gradient, hessian, soft);
  };
  return assemble(of_face, context);
}

double NewtonSystem::assemble(const FaceEnergy& of_face, ExecutionContext& context) {
  const auto count = at(faces_.rows());
  const double energy = sum_of(context, count, kGrain, [&](std::size_t f) {
    return of_face(f, &face_gradient_[6 * f], &face_hessian_[kHessianEntries * f]);
  });

  const Index* column = matrix_.outerIndexPtr();
  double* values = matrix_.valuePtr();
  parallel_for(context, vertex_of_.size(), kVertexGrain,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 std::fill(values + column[2 * begin], values + column[2 * end], 0.0);
                 for (std::size_t i = begin; i < end; ++i) {
                   double* first = values + column[2 * i];
                   double* second = values + column[2 * i + 1];
                   double gradient[2] = {0, 0};
                   for (const CornerId c : corners_[static_cast<Index>(i)]) {
                     const std::size_t f = at(c) / 3;
                     const std::size_t k = at(c) % 3;
                     const double* h = &face_hessian_[kHessianEntries * f];
                     gradient[0] += face_gradient_[6 * f + 2 * k];
                     gradient[1] += face_gradient_[6 * f + 2 * k + 1];
                     first[0] += h[3 * k];
                     first[1] += h[3 * k + 1];
                     second[0] += h[3 * k + 2];
                     // The block of the half-edge that leaves this corner has this vertex first,
                     // the one that enters has it second.
                     for (const CornerId e : {c, previous_corner(c)}) {
                       const bool leaves = e == c;
                       const CornerId other = leaves ? next_corner(c) : e;
                       if (number_of_[at(faces_.data()[other])] <= static_cast<Index>(i)) continue;
                       const double* block = h + 9 + 4 * (at(e) % 3);
                       const std::size_t s = 2 * at(slot_[at(e)]);
                       first[2 + s] += block[0];
                       first[3 + s] += block[leaves ? 1 : 2];
                       second[1 + s] += block[leaves ? 2 : 1];
                       second[2 + s] += block[3];
                     }
                   }
                   gradient_[2 * i] = gradient[0];
                   gradient_[2 * i + 1] = gradient[1];
                 }
               });
  return energy;
}

void NewtonSystem::add_prescribed(const Points2& motion) {
  for (std::size_t f = 0; f < at(static_cast<Index>(faces_.rows())); ++f) {
    const Index* v = faces_.data() + 3 * f;
    const double* h = &face_hessian_[kHessianEntries * f];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      const double* block = h + 9 + 4 * k;
      const auto add_to = [&](VertexId to, VertexId from, double uu, double uv, double vu,
                              double vv) {
        const Index i = number_of_[at(to)];
        if (i == kInvalid || number_of_[at(from)] != kInvalid) return;
        gradient_[2 * at(i)] += uu * motion(from, 0) + uv * motion(from, 1);
        gradient_[2 * at(i) + 1] += vu * motion(from, 0) + vv * motion(from, 1);
      };
      add_to(v[k], v[l], block[0], block[1], block[2], block[3]);
      add_to(v[l], v[k], block[0], block[2], block[1], block[3]);
    }
  }
}

void NewtonSystem::add(VertexId v, const double gradient[2], const double block[3]) {
  if (number_of_[at(v)] == kInvalid) return;
  const std::size_t i = at(number_of_[at(v)]);
  gradient_[2 * i] += gradient[0];
  gradient_[2 * i + 1] += gradient[1];
  const Index* column = matrix_.outerIndexPtr();
  double* first = matrix_.valuePtr() + column[2 * i];
  first[0] += block[0];
  first[1] += block[1];
  matrix_.valuePtr()[column[2 * i + 1]] += block[2];
}

bool NewtonSystem::add_block(VertexId v, VertexId w, const double block[4]) {
  const auto [low, high] = std::minmax(number_of_[at(v)], number_of_[at(w)]);
  if (low == kInvalid) return true;
  const Index* column = matrix_.outerIndexPtr() + 2 * low;
  const Index* begin = matrix_.innerIndexPtr() + column[0];
  const Index* end = matrix_.innerIndexPtr() + column[1];
  const Index* found = std::lower_bound(begin, end, 2 * high);
  if (found == end || *found != 2 * high) return false;
  double* first = matrix_.valuePtr() + column[0] + (found - begin);
  double* second = matrix_.valuePtr() + column[1] + (found - begin - 1);
  const bool ordered = number_of_[at(v)] == low;
  first[0] += block[0];
  first[1] += block[ordered ? 1 : 2];
  second[0] += block[ordered ? 2 : 1];
  second[1] += block[3];
  return true;
}

double NewtonSystem::solve(Points2& direction, ExecutionContext& context) {
  direction.setZero(static_cast<Eigen::Index>(number_of_.size()), 2);
  if (vertex_of_.empty()) return 0;
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
    ++factorizations_;
    if (cholesky_.factorize(matrix_, context)) break;
  }
  const Eigen::Map<const Eigen::VectorXd> gradient(gradient_.data(),
                                                   static_cast<Eigen::Index>(gradient_.size()));
  const Eigen::MatrixXd x = cholesky_.solve(-gradient, context);
  double product = 0;
  for (std::size_t i = 0; i < vertex_of_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 * i);
    direction(vertex_of_[i], 0) = x(row);
    direction(vertex_of_[i], 1) = x(row + 1);
    product += x(row) * gradient(row) + x(row + 1) * gradient(row + 1);
  }
  return product;
}

}  // namespace flipfree::distortion
