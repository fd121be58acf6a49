#include "flipfree/distortion/seams/seam_system.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion {
namespace {

// One corner's dependence on one node: the 2 x 2 matrix (re, -im; im, re).
struct Dependence {
  int corner = 0;
  Index node = kInvalid;
  double re = 1;
  double im = 0;
};

void dependences(const SeamConstraints& constraints, const Triangles& faces, FaceId f,
                 std::vector<Dependence>& out) {
  out.clear();
  for (int k = 0; k < 3; ++k) {
    const std::size_t v = at(faces(f, k));
    const auto divisor = static_cast<double>(constraints.divisor[v]);
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const NodeTerm& term = constraints.terms[at(t)];
      out.push_back({k, term.node, static_cast<double>(term.factor.re) / divisor,
                     static_cast<double>(term.factor.im) / divisor});
    }
  }
}

// Block (k, l) of a triangle's Hessian as (uu, uv, vu, vv), first letter for corner k.
std::array<double, 4> block_of(const double* hessian, int k, int l) {
  if (k == l) {
    const double* b = hessian + static_cast<std::ptrdiff_t>(3) * k;
    return {b[0], b[1], b[1], b[2]};
  }
  const bool forward = l == (k + 1) % 3;
  const double* b = hessian + 9 + static_cast<std::ptrdiff_t>(4) * (forward ? k : l);
  if (forward) return {b[0], b[1], b[2], b[3]};
  return {b[0], b[2], b[1], b[3]};
}

// C_a' B C_b.
std::array<double, 4> between(const Dependence& a, const std::array<double, 4>& b,
                              const Dependence& c) {
  // B C_c
  const double p[4] = {b[0] * c.re + b[1] * c.im, b[1] * c.re - b[0] * c.im,
                       b[2] * c.re + b[3] * c.im, b[3] * c.re - b[2] * c.im};
  return {a.re * p[0] + a.im * p[2], a.re * p[1] + a.im * p[3], a.re * p[2] - a.im * p[0],
          a.re * p[3] - a.im * p[1]};
}

// Pairs of nodes that some face has both of, once each, ascending; a node with itself where a face
// has no other. One row of the matrix after the other: where translations are long sums most pairs
// are those of many faces.
std::vector<std::array<VertexId, 2>> couplings_of(const SeamConstraints& constraints,
                                                  const Triangles& faces,
                                                  const std::vector<FaceId>& chosen,
                                                  ExecutionContext& context) {
  std::vector<std::size_t> begin{0};
  std::vector<Index> nodes;  // of each face, ascending
  std::vector<Dependence> found;
  for (const FaceId f : chosen) {
    context.check();
    dependences(constraints, faces, f, found);
    const auto first = static_cast<std::ptrdiff_t>(nodes.size());
    for (const Dependence& d : found) nodes.push_back(d.node);
    std::sort(nodes.begin() + first, nodes.end());
    nodes.erase(std::unique(nodes.begin() + first, nodes.end()), nodes.end());
    begin.push_back(nodes.size());
  }
  const Lists<std::size_t> faces_of(at(constraints.node_count()), [&](const auto& add) {
    for (std::size_t i = 0; i + 1 < begin.size(); ++i) {
      for (std::size_t k = begin[i]; k < begin[i + 1]; ++k) add(nodes[k], i);
    }
  });
  std::vector<Index> seen(at(constraints.node_count()), kInvalid);
  std::vector<std::array<VertexId, 2>> couplings;
  for (Index node = 0; node < constraints.node_count(); ++node) {
    context.check();
    const auto row = static_cast<std::ptrdiff_t>(couplings.size());
    for (const std::size_t i : faces_of[node]) {
      const bool alone = begin[i + 1] - begin[i] == 1;
      for (std::size_t k = begin[i + 1]; k > begin[i] && (nodes[k - 1] > node || alone); --k) {
        const Index other = nodes[k - 1];
        if (seen[at(other)] == node) continue;
        seen[at(other)] = node;
        couplings.push_back({node, other});
      }
    }
    std::sort(couplings.begin() + row, couplings.end());
  }
  return couplings;
}

}  // namespace

SeamSystem::SeamSystem(const SeamConstraints& constraints, const Triangles& faces,
                       const std::vector<char>& fixed, ExecutionContext& context)
    : constraints_(constraints), faces_(faces) {
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    const bool own = constraints.is_own_node(faces(f, 0)) && constraints.is_own_node(faces(f, 1)) &&
                     constraints.is_own_node(faces(f, 2));
    (own ? plain_ : seam_).push_back(f);
  }
  plain_faces_.resize(static_cast<Eigen::Index>(plain_.size()), 3);
  for (std::size_t i = 0; i < plain_.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const std::size_t v = at(faces(plain_[i], k));
      plain_faces_(static_cast<Eigen::Index>(i), k) =
          constraints.terms[at(constraints.begin[v])].node;
    }
  }
  plain_rest_.resize(plain_.size());
  std::vector<char> fixed_node(at(constraints.node_count()), 0);
  bool any = false;
  for (std::size_t v = 0; v < fixed.size(); ++v) {
    if (!fixed[v]) continue;
    any = true;
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t)
      fixed_node[at(constraints.terms[at(t)].node)] = 1;
  }
  if (any) {
    std::fill(fixed_node.begin() + constraints.position_count(), fixed_node.end(), char{1});
  }
  nodes_ = Points2::Zero(constraints.node_count(), 2);
  system_.emplace(plain_faces_, fixed_node, couplings_of(constraints, faces, seam_, context),
                  context);
}

double SeamSystem::assemble(const std::vector<RestTriangle>& rest, const Points2& uv, bool soft,
                            ExecutionContext& context) {
  for (std::size_t i = 0; i < plain_.size(); ++i) plain_rest_[i] = rest[at(plain_[i])];
  for (Index n = 0; n < constraints_.position_count(); ++n)
    nodes_.row(n) = uv.row(constraints_.position[at(n)]);
  const double energy = system_->assemble(plain_rest_, nodes_, soft, context);
  if (motion_.rows() > 0) system_->add_prescribed(motion_);
  return energy + add_seam_faces(rest, uv, soft, context);
}

double SeamSystem::add_seam_faces(const std::vector<RestTriangle>& rest, const Points2& uv,
                                  bool soft, ExecutionContext& context) {
  double energy = 0;
  for (const FaceId f : seam_) {
    context.check();
    double gradient[6];
    double hessian[kHessianEntries];
    const RestTriangle& r = rest[at(f)];
    energy += r.weight * symmetric_dirichlet_derivatives(r, jacobian(r, faces_, at(f), uv),
                                                         gradient, hessian, soft);
    add_face(f, gradient, hessian);
  }
  return energy;
}

void SeamSystem::add_face(FaceId f, const double gradient[6],
                          const double hessian[kHessianEntries]) {
  std::vector<Dependence> found;
  dependences(constraints_, faces_, f, found);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Dependence& a = found[i];
    const double gu = gradient[2 * a.corner];
    const double gv = gradient[2 * a.corner + 1];
    double own_gradient[2] = {a.re * gu + a.im * gv, a.re * gv - a.im * gu};
    const auto own = between(a, block_of(hessian, a.corner, a.corner), a);
    double diagonal[3] = {own[0], own[1], own[3]};
    const bool real = constraints_.real[at(a.node)] != 0;
    for (std::size_t j = 0; j < found.size(); ++j) {
      const Dependence& b = found[j];
      if (j == i) continue;
      auto block = between(a, block_of(hessian, a.corner, b.corner), b);
      // The second coordinate of a real node stays zero.
      if (a.node != b.node && real) block[2] = block[3] = 0;
      if (a.node != b.node && constraints_.real[at(b.node)]) block[1] = block[3] = 0;
      if (a.node != b.node && motion_.rows() > 0) {
        const Vector2 m = motion_.row(b.node);
        own_gradient[0] += block[0] * m.x() + block[1] * m.y();
        own_gradient[1] += block[2] * m.x() + block[3] * m.y();
      }
      if (a.node == b.node) {
        diagonal[0] += block[0];
        diagonal[1] += 0.5 * (block[1] + block[2]);
        diagonal[2] += block[3];
      } else if (i < j && !system_->add_block(a.node, b.node, block.data())) {
        throw InternalError("a block of a seam triangle is missing in the pattern");
      }
    }
    if (real) {
      own_gradient[1] = diagonal[1] = 0;
      diagonal[2] = own[0] + own[3];
    }
    system_->add(a.node, own_gradient, diagonal);
  }
}

double SeamSystem::solve(Points2& direction, ExecutionContext& context) {
  Points2 nodes;
  const double slope = system_->solve(nodes, context);
  if (motion_.rows() > 0) nodes += motion_;
  direction = map_of(constraints_, nodes);
  return slope;
}

}  // namespace flipfree::distortion
