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

std::vector<Dependence> dependences(const SeamConstraints& constraints, const Triangles& faces,
                                    FaceId f) {
  std::vector<Dependence> out;
  for (int k = 0; k < 3; ++k) {
    const std::size_t v = at(faces(f, k));
    const auto divisor = static_cast<double>(constraints.divisor[v]);
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const NodeTerm& term = constraints.terms[at(t)];
      out.push_back({k, term.node, static_cast<double>(term.factor.re) / divisor,
                     static_cast<double>(term.factor.im) / divisor});
    }
  }
  return out;
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

// Pairs of nodes that some face has both of, once each, ascending, and each node with itself. One
// row of the matrix after the other: where translations are long sums most pairs are those of many
// faces.
std::vector<std::array<VertexId, 2>> couplings_of(const SeamConstraints& constraints,
                                                  const Triangles& faces,
                                                  const std::vector<FaceId>& chosen,
                                                  ExecutionContext& context) {
  std::vector<std::vector<Index>> nodes(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    context.check();
    for (const Dependence& d : dependences(constraints, faces, chosen[i]))
      nodes[i].push_back(d.node);
  }
  const Lists<std::size_t> faces_of(at(constraints.node_count()), [&](const auto& add) {
    for (std::size_t i = 0; i < nodes.size(); ++i)
      for (const Index node : nodes[i]) add(node, i);
  });
  std::vector<std::array<VertexId, 2>> couplings;
  std::vector<Index> row;
  for (Index node = 0; node < constraints.node_count(); ++node) {
    row.clear();
    for (const std::size_t i : faces_of[node]) {
      context.check();
      for (const Index other : nodes[i])
        if (other >= node) row.push_back(other);
    }
    sort_unique(row);
    for (const Index other : row) couplings.push_back({node, other});
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
  system_.emplace(plain_faces_, fixed_node, couplings_of(constraints, faces, seam_, context),
                  context);
}

double SeamSystem::do_assemble(const FaceEnergy& of_face, ExecutionContext& context) {
  const auto of_plain = [&](std::size_t i, double* gradient, double* hessian) {
    return of_face(at(plain_[i]), gradient, hessian);
  };
  const double energy = system_->assemble(of_plain, context);
  double of_seams = 0;
  for (const FaceId f : seam_) {
    context.check();
    double gradient[6];
    double hessian[kHessianEntries];
    of_seams += of_face(at(f), gradient, hessian);
    add_face(f, gradient, hessian);
  }
  return energy + of_seams;
}

void SeamSystem::add_face(FaceId f, const double gradient[6],
                          const double hessian[kHessianEntries]) {
  const std::vector<Dependence> found = dependences(constraints_, faces_, f);
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

double SeamSystem::do_solve(Points2& direction, ExecutionContext& context) {
  Points2 nodes;
  const double slope = system_->solve(nodes, context);
  direction = map_of(constraints_, nodes);
  return slope;
}

}  // namespace flipfree::distortion
