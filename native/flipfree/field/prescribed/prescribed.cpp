#include "flipfree/field/prescribed/prescribed.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/field/topology/tree_cotree.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::field {
namespace {

[[noreturn]] void refuse_sum(Index root, std::int64_t missing) {
  const std::string amount = std::to_string(std::abs(missing));
  throw_infeasible(ErrorCode::kGaussBonnet,
                   "The quarter turns of the cones on the component of vertex " +
                       std::to_string(root) + " do not fit its genus (Gauss-Bonnet). " +
                       (missing > 0 ? "Add " : "Take ") + amount + (missing > 0 ? " to" : " from") +
                       " their sum.",
                   {"angle sum", {{"missing quarter turns", {static_cast<double>(missing)}}}},
                   ElementKind::kVertex, {root});
}

// Every vertex but the roots gets its number from its parent; the roots then have theirs, if the
// sum is right.
void meet_cones(const Triangles& faces, const mesh::Adjacency& adjacency, const Frames& frames,
                const std::vector<Index>& cones, const TreeCotree& tree, CrossField& field) {
  const std::vector<Index> now = cone_turns(faces, adjacency, frames, field);
  std::vector<std::int64_t> lacking(cones.size(), 0);
  for (std::size_t v = 0; v < cones.size(); ++v) lacking[v] = std::int64_t{cones[v]} - now[v];
  for (auto v = tree.order.rbegin(); v != tree.order.rend(); ++v) {
    if (adjacency.vertex_halfedge[at(*v)] == kInvalid) continue;
    const HalfedgeId up = tree.to_parent[at(*v)];
    if (up == kInvalid) {
      if (lacking[at(*v)] != 0) refuse_sum(*v, -lacking[at(*v)]);
      continue;
    }
    // Along `up` the matching is lowered: its source gains, its target loses.
    const auto by = static_cast<Index>(lacking[at(*v)]);
    field.matching[at(up)] -= by;
    field.matching[at(adjacency.opposite[at(up)])] += by;
    lacking[at(mesh::target(faces, up))] += by;
    lacking[at(*v)] = 0;
  }
}

void check_strips(const std::vector<LoopTurn>& loops, const mesh::Adjacency& adjacency) {
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const DualLoop& loop = loops[i].loop;
    const auto inside = [&](HalfedgeId h) { return h >= 0 && at(h) < adjacency.opposite.size(); };
    bool good = !loop.empty();
    for (std::size_t k = 0; good && k < loop.size(); ++k) {
      const HalfedgeId after = loop[(k + 1) % loop.size()];
      const HalfedgeId entered = inside(loop[k]) ? adjacency.opposite[at(loop[k])] : kInvalid;
      good = entered != kInvalid && inside(after) && entered / 3 == after / 3 && entered != after;
    }
    if (!good) {
      throw_invalid(ErrorCode::kBadOption,
                    "Loop " + std::to_string(i) +
                        " is not a closed strip of faces. Give faces each of which shares an edge "
                        "with the next one, without turning back.");
    }
  }
}

std::vector<EdgeChain> chains_of(const Triangles& faces, const mesh::Adjacency& adjacency,
                                 const TreeCotree& tree) {
  std::vector<EdgeChain> chains;
  for (std::size_t i = 0; i < tree.loops.size(); ++i)
    chains.push_back(chain_of(faces, adjacency, tree, i));
  return chains;
}

// How often each loop crosses each chain, from right to left.
Eigen::MatrixXd crossings(const mesh::Adjacency& adjacency, const std::vector<LoopTurn>& loops,
                          const std::vector<EdgeChain>& chains) {
  const auto count = static_cast<Eigen::Index>(loops.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(count, static_cast<Eigen::Index>(chains.size()));
  std::vector<Index> on(adjacency.opposite.size(), 0);
  for (std::size_t j = 0; j < chains.size(); ++j) {
    const auto add = [&](Index by) {
      for (const HalfedgeId h : chains[j]) {
        on[at(h)] += by;
        on[at(adjacency.opposite[at(h)])] -= by;
      }
    };
    add(1);
    for (Eigen::Index i = 0; i < count; ++i) {
      for (const HalfedgeId h : loops[static_cast<std::size_t>(i)].loop)
        matrix(i, static_cast<Eigen::Index>(j)) += on[at(h)];
    }
    add(-1);
  }
  return matrix;
}

void meet_loops(const Triangles& faces, const mesh::Adjacency& adjacency,
                const std::vector<LoopTurn>& loops, const TreeCotree& tree, CrossField& field) {
  check_strips(loops, adjacency);
  const std::vector<EdgeChain> chains = chains_of(faces, adjacency, tree);
  const auto refuse = [&] {
    throw_invalid(
        ErrorCode::kBadOption,
        "The loops do not generate the surface's homology: " + std::to_string(loops.size()) +
            " loops, of which " + std::to_string(chains.size()) +
            " are needed that are independent and leave nothing out. Give those of a "
            "homology basis, such as signature() has them.");
  };
  if (loops.size() != chains.size()) refuse();
  if (loops.empty()) return;
  Eigen::VectorXd lacking(static_cast<Eigen::Index>(loops.size()));
  for (std::size_t i = 0; i < loops.size(); ++i) {
    lacking[static_cast<Eigen::Index>(i)] =
        loops[i].quarter_turns - turning_number(adjacency, field, loops[i].loop);
  }
  const Eigen::FullPivLU<Eigen::MatrixXd> factor(crossings(adjacency, loops, chains));
  if (!factor.isInvertible()) refuse();
  const Eigen::VectorXd by = factor.solve(lacking);
  for (std::size_t j = 0; j < chains.size(); ++j) {
    const double whole = std::round(by[static_cast<Eigen::Index>(j)]);
    if (!(std::abs(whole) < 1e8)) refuse();
    add_along(adjacency, chains[j], static_cast<Index>(whole), field);
  }
  // Rounded, then counted: what is returned is exact.
  for (const LoopTurn& loop : loops) {
    if (turning_number(adjacency, field, loop.loop) != loop.quarter_turns) refuse();
  }
}

// Turns that need nearly the least rotation: least squares over the real numbers, rounded.
void choose_turns(const Triangles& faces, const mesh::Adjacency& adjacency, const Frames& frames,
                  const TreeCotree& tree, const AngleSystem& system, CrossField& field,
                  ExecutionContext& context) {
  const std::vector<EdgeChain> chains = chains_of(faces, adjacency, tree);
  if (chains.empty()) return;
  const std::vector<double> rotation = rotation_form(adjacency, frames, field);
  const auto count = static_cast<Eigen::Index>(chains.size());
  // The part of each chain that no turning of directions takes away: a harmonic form.
  std::vector<std::vector<double>> harmonic;
  for (const EdgeChain& chain : chains) {
    std::vector<double>& form = harmonic.emplace_back(adjacency.opposite.size(), 0.0);
    for (const HalfedgeId h : chain) {
      form[at(h)] += kQuarterTurn;
      form[at(adjacency.opposite[at(h)])] -= kQuarterTurn;
    }
    const std::vector<double> turned = system.solve(form, {}, context);
    for (HalfedgeId h = 0; at(h) < form.size(); ++h)
      form[at(h)] += turned[at(h / 3)] - turned[at(adjacency.opposite[at(h)] / 3)];
  }
  const auto product = [&](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t h = 0; h < a.size(); ++h) sum += system.weight()[h] * a[h] * b[h];
    return sum;
  };
  Eigen::MatrixXd gram(count, count);
  Eigen::VectorXd share(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    share[i] = product(harmonic[static_cast<std::size_t>(i)], rotation);
    for (Eigen::Index j = 0; j <= i; ++j) {
      gram(i, j) = gram(j, i) =
          product(harmonic[static_cast<std::size_t>(i)], harmonic[static_cast<std::size_t>(j)]);
    }
    context.check();
  }
  const Eigen::VectorXd by = numeric::solve_symmetric(gram, -share);
  for (std::size_t j = 0; j < chains.size(); ++j) {
    const double whole = std::round(by[static_cast<Eigen::Index>(j)]);
    if (std::abs(whole) < 1e6) add_along(adjacency, chains[j], static_cast<Index>(whole), field);
  }
}

}  // namespace

void add_along(const mesh::Adjacency& adjacency, const std::vector<HalfedgeId>& chain, Index by,
               CrossField& field) {
  for (const HalfedgeId h : chain) {
    field.matching[at(h)] += by;
    field.matching[at(adjacency.opposite[at(h)])] -= by;
  }
}

CrossField field_with_signature(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                const Frames& frames, const std::vector<Index>& cones,
                                const std::optional<std::vector<LoopTurn>>& loops,
                                ExecutionContext& context) {
  const auto faces = static_cast<std::size_t>(surface.faces.rows());
  CrossField field{std::vector<double>(faces, 0.0), std::vector<Index>(3 * faces, 0)};
  const TreeCotree tree = tree_cotree(surface, adjacency, context);
  meet_cones(surface.faces, adjacency, frames, cones, tree, field);
  if (loops) meet_loops(surface.faces, adjacency, *loops, tree, field);
  const AngleSystem system(surface, adjacency, std::vector<char>(faces, 0),
                           std::vector<double>(faces, 0.0), context);
  if (!loops) choose_turns(surface.faces, adjacency, frames, tree, system, field, context);
  relax(adjacency, frames, system, field, context);
  return field;
}

}  // namespace flipfree::field
