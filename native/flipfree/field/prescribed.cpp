#include "flipfree/field/prescribed.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <queue>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::field {

using intrinsic::EdgeChain;
using intrinsic::TreeCotree;

namespace {

// Pulls of a smaller share of the weights of a component's edges do not hold it against rounding.
constexpr double kHolds = 1e-9;

}  // namespace

AngleSystem::AngleSystem(const Frames& frames, std::vector<char> held, std::vector<double> pull,
                         ExecutionContext& context)
    : frames_(frames),
      weight_(edge_weights(frames.surface, face_areas(frames.surface))),
      pull_(std::move(pull)) {
  const mesh::Adjacency& adjacency = frames.surface.adjacency();
  const mesh::Components components = mesh::face_components(adjacency);
  std::vector<char> anchored(at(components.count), 0);
  std::vector<double> pulled(at(components.count), 0.0), joined(at(components.count), 0.0);
  for (std::size_t f = 0; f < held.size(); ++f) {
    const std::size_t part = at(components.of_face[f]);
    if (held[f] != 0) anchored[part] = 1;
    pulled[part] += pull_[f];
    for (std::size_t h = 3 * f; h < 3 * f + 3; ++h) joined[part] += weight_[h];
  }
  for (std::size_t part = 0; part < anchored.size(); ++part) {
    if (pulled[part] > kHolds * joined[part]) anchored[part] = 1;
  }
  for (std::size_t f = 0; f < held.size(); ++f) {
    char& done = anchored[at(components.of_face[f])];
    if (done == 0) held[f] = done = 1;
  }
  std::vector<double> diagonal(pull_);
  std::vector<GraphEdge<double>> edges;
  for (HalfedgeId h = 0; at(h) < weight_.size(); ++h) {
    diagonal[at(h / 3)] += weight_[at(h)];
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o > h) edges.push_back({h / 3, o / 3, weight_[at(h)], 1.0});
  }
  system_.emplace(edges, diagonal, held, context);
}

Eigen::VectorXd AngleSystem::solve(const std::vector<double>& rotation,
                                   const std::vector<double>& wish,
                                   ExecutionContext& context) const {
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(std::ssize(pull_));
  for (HalfedgeId h = 0; at(h) < rotation.size(); ++h)
    rhs[h / 3] -= weight_[at(h)] * rotation[at(h)];
  for (Eigen::Index f = 0; f < std::ssize(wish); ++f) rhs[f] += pull_[at(f)] * wish[at(f)];
  return system_->solve(rhs, Eigen::VectorXd::Zero(rhs.size()), context);
}

void AngleSystem::relax(const std::vector<double>& wish, CrossField& field,
                        ExecutionContext& context) const {
  std::vector<double> offset(wish.size());
  for (std::size_t f = 0; f < wish.size(); ++f)
    offset[f] = std::remainder(wish[f] - field.angle[f], kQuarterTurn);
  const Eigen::VectorXd turned = solve(rotation_form(frames_, field), offset, context);
  for (std::size_t f = 0; f < field.angle.size(); ++f)
    field.angle[f] += turned[static_cast<Eigen::Index>(f)];
}

void AngleSystem::descend(const std::vector<double>& wish, CrossField& field,
                          ExecutionContext& context) const {
  // Every round lowers the sum: relaxing is a minimum, and the nearest matching the least rotation.
  constexpr int kMostRounds = 5;
  for (int round = 0; round < kMostRounds; ++round) {
    relax(wish, field, context);
    CrossField next = match_nearest(frames_, field.angle);
    const bool same = next.matching == field.matching;
    field = std::move(next);
    if (same) break;
  }
}

namespace {

[[noreturn]] void refuse_sum(Index root, std::int64_t missing) {
  const std::string amount = std::to_string(std::abs(missing));
  throw_infeasible(ErrorCode::kGaussBonnet,
                   "The quarter turns of the cones on the component of vertex " + vertex_id(root) +
                       " do not fit its genus (Gauss-Bonnet). " + (missing > 0 ? "Add " : "Take ") +
                       amount + (missing > 0 ? " to" : " from") + " their sum.",
                   {"angle sum", {{"missing quarter turns", {static_cast<double>(missing)}}}},
                   ElementKind::kVertex, {root});
}

// Whole numbers x with a x = b, by column operations that make a triangular (Hermite); none where
// there are no such numbers, or rows are dependent and not `may_depend`.
std::optional<std::vector<std::int64_t>> whole_solution(const Eigen::MatrixXd& a,
                                                        const std::vector<std::int64_t>& b,
                                                        bool may_depend) {
  constexpr std::int64_t kMost = std::int64_t{1} << 30;  // products stay in range
  using Whole = Eigen::Matrix<std::int64_t, Eigen::Dynamic, Eigen::Dynamic>;
  const Eigen::Index rows = a.rows(), count = a.cols();
  // The columns of a, and below them which of these each is a sum of.
  Whole columns(rows + count, count);
  columns << a.array().round().cast<std::int64_t>().matrix(), Whole::Identity(count, count);
  Whole sum = Whole::Zero(rows + count, 1);
  Eigen::Index place = 0;  // columns before it have their pivots
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = place + 1; j < count; ++j) {
      while (columns(i, j) != 0) {  // Euclid's algorithm: the smaller one decreases
        columns.col(place) -= columns(i, place) / columns(i, j) * columns.col(j);
        if (columns.col(place).cwiseAbs().maxCoeff() > kMost) return std::nullopt;
        columns.col(place).swap(columns.col(j));
      }
    }
    const std::int64_t pivot = place < count ? columns(i, place) : 0, left = b[at(i)] - sum(i);
    if (pivot == 0 && left == 0 && may_depend) continue;
    if (pivot == 0 || left % pivot != 0) return std::nullopt;
    sum += left / pivot * columns.col(place);
    if (sum.cwiseAbs().maxCoeff() > kMost) return std::nullopt;
    ++place;
  }
  return std::vector<std::int64_t>(sum.data() + rows, sum.data() + sum.size());
}

// Raises the matching along a chain of half-edges, head to tail, by so much.
void add_along(const mesh::Surface& surface, const std::vector<HalfedgeId>& chain, Index by,
               CrossField& field) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  for (const HalfedgeId h : chain) {
    field.matching[at(h)] += by;
    field.matching[at(opposite[at(h)])] -= by;
  }
}

class Prescriber {
 public:
  Prescriber(const Frames& frames, ExecutionContext& context)
      : frames_(frames),
        surface_(frames.surface),
        adjacency_(surface_.adjacency()),
        context_(context),
        tree_(intrinsic::tree_cotree(surface_, context)),
        field_{std::vector<double>(at(surface_.faces.rows()), 0.0),
               std::vector<Index>(at(surface_.faces.size()), 0)} {
    find_borders();
    find_chains();
  }

  CrossField run(const std::vector<Index>& cones,
                 const std::optional<std::vector<LoopTurn>>& loops) {
    meet_cones(cones);
    const std::size_t faces = field_.angle.size();
    const AngleSystem system(frames_, std::vector<char>(faces, 0), std::vector<double>(faces, 0.0),
                             context_);
    if (!loops || !borders_.empty() || loops->size() < tree_.loops.size()) choose_turns(system);
    if (loops) meet_loops(*loops);
    system.relax({}, field_, context_);
    return std::move(field_);
  }

 private:
  void find_borders() {
    std::vector<char> open(tree_.stands_for.size(), 0);
    for (HalfedgeId h = 0; at(h) < adjacency_.opposite.size(); ++h) {
      if (adjacency_.opposite[at(h)] == kInvalid)
        open[at(tree_.stands_for[at(mesh::source(surface_.faces, h))])] = 1;
    }
    root_.assign(open.size(), kInvalid);
    for (const VertexId v : tree_.order) {
      const HalfedgeId up = tree_.to_parent[at(v)];
      root_[at(v)] = up == kInvalid ? v : root_[at(parent_over(up))];
      if (open[at(v)] != 0) borders_.push_back(v);
    }
  }
  // Of the vertex from which the half-edge leads there.
  VertexId parent_over(HalfedgeId up) const {
    return tree_.stands_for[at(mesh::target(surface_.faces, up))];
  }

  void find_chains() {
    for (std::size_t i = 0; i < tree_.loops.size(); ++i)
      chains_.push_back(intrinsic::chain_of(surface_, tree_, i));
    for (std::size_t i = 1; i < borders_.size(); ++i) {
      const VertexId from = borders_[i - 1], to = borders_[i];
      if (root_[at(from)] == root_[at(to)])
        chains_.push_back(intrinsic::tree_path(surface_, tree_, from, to));
    }
  }

  // Every vertex but the roots gets its number from its parent; the roots then have theirs, if the
  // sum is right. A boundary loop has the sum of its vertices' numbers; the first one of a
  // component on which every vertex is to go straight on (2) takes what is left.
  void meet_cones(const std::vector<Index>& cones) {
    const std::vector<Index> now = cone_turns(frames_, field_);
    std::vector<std::int64_t> lacking(cones.size(), 0), left(cones.size(), 0);
    std::vector<char> bent(cones.size(), 0);
    for (std::size_t v = 0; v < cones.size(); ++v) {
      if (adjacency_.vertex_halfedge[v] == kInvalid) continue;
      const std::size_t own = at(tree_.stands_for[v]);
      lacking[own] += std::int64_t{cones[v]} - now[v];
      left[at(root_[own])] += std::int64_t{cones[v]} - now[v];
      if (cones[v] != 2) bent[own] = 1;
    }
    for (const VertexId loop : borders_) {
      if (bent[at(loop)] == 0) lacking[at(loop)] -= std::exchange(left[at(root_[at(loop)])], 0);
    }
    for (auto v = tree_.order.rbegin(); v != tree_.order.rend(); ++v) {
      if (adjacency_.vertex_halfedge[at(*v)] == kInvalid) continue;
      const HalfedgeId up = tree_.to_parent[at(*v)];
      if (up == kInvalid) {
        if (lacking[at(*v)] != 0) refuse_sum(*v, -lacking[at(*v)]);
        continue;
      }
      // Along `up` the matching is lowered: its source gains, its target loses.
      const auto by = static_cast<Index>(lacking[at(*v)]);
      field_.matching[at(up)] -= by;
      field_.matching[at(adjacency_.opposite[at(up)])] += by;
      lacking[at(parent_over(up))] += std::exchange(lacking[at(*v)], 0);
    }
  }

  void check_strips(const std::vector<LoopTurn>& loops) const {
    const std::vector<HalfedgeId>& opposite = adjacency_.opposite;
    const auto inside = [&](HalfedgeId h) { return h >= 0 && at(h) < opposite.size(); };
    for (std::size_t i = 0; i < loops.size(); ++i) {
      const DualLoop& loop = loops[i].loop;
      bool good = !loop.empty();
      for (std::size_t k = 0; good && k < loop.size(); ++k) {
        const HalfedgeId after = loop[(k + 1) % loop.size()];
        const HalfedgeId entered = inside(loop[k]) ? opposite[at(loop[k])] : kInvalid;
        good = entered != kInvalid && inside(after) && entered / 3 == after / 3 && entered != after;
      }
      if (good) continue;
      throw_invalid(ErrorCode::kBadOption,
                    "Loop " + std::to_string(i) +
                        " is not a closed strip of faces. Give faces each of which shares an edge "
                        "with the next one, without turning back.");
    }
  }

  // Per half-edge: by how much the matching rises with the chain.
  std::vector<Index> raised_by(const EdgeChain& chain) const {
    CrossField field{{}, std::vector<Index>(adjacency_.opposite.size(), 0)};
    add_along(surface_, chain, 1, field);
    return std::move(field.matching);
  }

  // How often each loop crosses each chain, from right to left.
  Eigen::MatrixXd crossings(const std::vector<LoopTurn>& loops) const {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(std::ssize(loops), std::ssize(chains_));
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      const std::vector<Index> raised = raised_by(chains_[at(j)]);
      for (Eigen::Index i = 0; i < matrix.rows(); ++i)
        for (const HalfedgeId h : loops[at(i)].loop) matrix(i, j) += raised[at(h)];
    }
    return matrix;
  }

  void meet_loops(const std::vector<LoopTurn>& loops) {
    check_strips(loops);
    // Loops along all boundaries of a component are sums of the others and of cones.
    const bool open = !borders_.empty();
    const auto refuse = [&] {
      throw_invalid(ErrorCode::kBadOption,
                    "No field with these cones turns so: of " + std::to_string(loops.size()) +
                        " loops, with " + std::to_string(chains_.size()) +
                        " in a basis of the homology, one is a sum of others, or turns as the "
                        "cones forbid. Give loops of a basis, or some of them, such as "
                        "signature() has.");
    };
    if (loops.size() > chains_.size() + borders_.size()) refuse();
    if (loops.empty()) return;
    std::vector<std::int64_t> lacking;
    for (const LoopTurn& loop : loops)
      lacking.push_back(loop.quarter_turns - turning_number(surface_, field_, loop.loop));
    const Eigen::MatrixXd crossing = crossings(loops);
    std::vector<std::int64_t> by;
    if (loops.size() == chains_.size() &&
        !open) {  // of a hundred handles whole numbers would grow too long
      const Eigen::FullPivLU<Eigen::MatrixXd> factor(crossing);
      if (!factor.isInvertible()) refuse();
      Eigen::VectorXd wanted(crossing.rows());
      std::copy(lacking.begin(), lacking.end(), wanted.begin());
      for (const double value : Eigen::VectorXd(factor.solve(wanted))) {
        if (!(std::abs(value) < 1e8)) refuse();
        by.push_back(std::llround(value));
      }
    } else if (const auto found = whole_solution(crossing, lacking, open)) {
      by = *found;
    } else {
      refuse();
    }
    for (std::size_t j = 0; j < chains_.size(); ++j)
      add_along(surface_, chains_[j], static_cast<Index>(by[j]), field_);
    // Rounded, then counted: what is returned is exact.
    for (const LoopTurn& loop : loops) {
      if (turning_number(surface_, field_, loop.loop) != loop.quarter_turns) refuse();
    }
  }

  // Turns that need nearly the least rotation: least squares over the real numbers, rounded.
  void choose_turns(const AngleSystem& system) {
    if (chains_.empty()) return;
    const std::vector<double> rotation = rotation_form(frames_, field_);
    const std::ptrdiff_t count = std::ssize(chains_);
    // The part of each chain that no turning of directions takes away: a harmonic form.
    Eigen::MatrixXd harmonic(std::ssize(rotation), count);
    for (Eigen::Index j = 0; j < count; ++j) {
      std::vector<double> form;
      for (const Index by : raised_by(chains_[at(j)])) form.push_back(by * kQuarterTurn);
      const Eigen::VectorXd turned = system.solve(form, {}, context_);
      for (HalfedgeId h = 0; at(h) < form.size(); ++h) {
        const HalfedgeId o = adjacency_.opposite[at(h)];
        harmonic(h, j) = form[at(h)] + (o == kInvalid ? 0.0 : turned[h / 3] - turned[o / 3]);
      }
    }
    using Form = Eigen::Map<const Eigen::VectorXd>;
    const Form weight(system.weight().data(), harmonic.rows());
    Eigen::MatrixXd gram(count, count);
    Eigen::VectorXd share(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      context_.check();
      const Eigen::VectorXd weighted = weight.cwiseProduct(harmonic.col(i));
      gram.row(i) = weighted.transpose() * harmonic;
      share[i] = weighted.dot(Form(rotation.data(), harmonic.rows()));
    }
    const Eigen::VectorXd by = numeric::solve_symmetric(gram, -share);
    for (std::size_t j = 0; j < chains_.size(); ++j) {
      const double whole = std::round(by[static_cast<Eigen::Index>(j)]);
      if (std::abs(whole) < 1e6) add_along(surface_, chains_[j], static_cast<Index>(whole), field_);
    }
  }

  const Frames& frames_;
  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  ExecutionContext& context_;
  const TreeCotree tree_;
  // Boundary loops, each as the vertex that stands for it, in the order of the tree; and per vertex
  // the root of its component, of what it stands for.
  std::vector<VertexId> borders_, root_;
  // 2 g closed ones, then from every boundary loop to the next one of its component.
  std::vector<EdgeChain> chains_;
  CrossField field_;
};

}  // namespace

CrossField field_with_signature(const Frames& frames, const std::vector<Index>& cones,
                                const std::optional<std::vector<LoopTurn>>& loops,
                                ExecutionContext& context) {
  return Prescriber(frames, context).run(cones, loops);
}

namespace {

// Share of the square root of the area at which a vertex takes a part of a sharp cone, and how many
// times farther one is looked for that has too many quarter turns.
constexpr double kSpread = 0.05;
constexpr double kFarther = 4.0;

}  // namespace

Simplified simplify(const Frames& frames, const std::vector<char>& held,
                    const SimplifyOptions& options, CrossField& field, ExecutionContext& context) {
  const mesh::Surface& surface = frames.surface;
  const mesh::Adjacency& adjacency = surface.adjacency();
  std::vector<Index> cones = cone_turns(frames, field);
  const auto is_inside = [&](VertexId v) {
    const HalfedgeId h = adjacency.vertex_halfedge[at(v)];
    return h != kInvalid && adjacency.opposite[at(h)] != kInvalid;
  };
  // Quarter turns are moved along edges inside, and not between two faces that are held.
  std::vector<double> length(adjacency.opposite.size(), mesh::ShortestPaths::kUnreached);
  for (HalfedgeId h = 0; at(h) < length.size(); ++h) {
    const VertexId a = mesh::source(surface.faces, h), b = mesh::target(surface.faces, h);
    if (!is_inside(a) || !is_inside(b)) continue;
    if (held[at(h / 3)] != 0 && held[at(adjacency.opposite[at(h)] / 3)] != 0) continue;
    length[at(h)] = (surface.vertices.row(b) - surface.vertices.row(a)).norm();
  }
  const double extent = std::sqrt(mesh::area_of(surface));
  const double reach = options.reach * extent;
  const double spread = kSpread * extent;
  Simplified result;
  // From one that has too many quarter turns to one that has too few.
  const auto move = [&](VertexId from, VertexId to, const std::vector<HalfedgeId>& path) {
    add_along(surface, path, 1, field);
    --cones[at(from)];
    ++cones[at(to)];
  };
  // A vertex that is wanted, as near as there is one.
  struct Pair {
    double distance;
    VertexId from;
    std::vector<HalfedgeId> path;  // from there to it; empty: there is none
    bool operator<(const Pair& other) const {
      return distance != other.distance ? distance > other.distance : from > other.from;
    }
  };
  mesh::ShortestPaths paths(surface.faces, adjacency, length);
  const auto nearest = [&](VertexId from, double most, const auto& wanted) {
    context.check();
    paths.restart(from, most);
    Pair found{mesh::ShortestPaths::kUnreached, from, {}};
    VertexId v = paths.grow_to([&](VertexId w) { return w != from && wanted(w); }, context);
    if (v == kInvalid) return found;
    found.distance = paths.distance(v);
    for (; v != from; v = paths.before(v)) found.path.push_back(paths.arrival(v));
    std::reverse(found.path.begin(), found.path.end());
    return found;
  };
  // Nearest pairs first. Each move brings two cones nearer to 4, so there is an end; what was found
  // before its partner was used up is looked for anew.
  std::priority_queue<Pair> pairs;
  const auto look = [&](VertexId v) {
    Pair found = nearest(v, reach, [&](VertexId w) { return cones[at(w)] < 4; });
    if (!found.path.empty()) pairs.push(std::move(found));
  };
  for (VertexId v = 0; reach > 0.0 && at(v) < cones.size(); ++v) {
    if (cones[at(v)] > 4 && is_inside(v)) look(v);
  }
  while (!pairs.empty()) {
    const Pair pair = pairs.top();
    pairs.pop();
    const VertexId to = mesh::target(surface.faces, pair.path.back());
    if (cones[at(to)] < 4) {
      move(pair.from, to, pair.path);
      ++result.cancelled;
    }
    if (cones[at(pair.from)] > 4) look(pair.from);
  }
  for (VertexId v = 0; at(v) < cones.size(); ++v) {
    while (cones[at(v)] < options.least_turns && is_inside(v)) {
      // A cone that has too many, else a regular vertex at some distance; three are left there.
      Pair found = nearest(v, kFarther * spread, [&](VertexId w) { return cones[at(w)] > 4; });
      const bool regular = found.path.empty();
      for (double least = spread; found.path.empty() && least > 1e-3 * spread; least *= 0.5) {
        found = nearest(v, kFarther * spread, [&](VertexId w) {
          return cones[at(w)] == 4 && paths.distance(w) >= least;
        });
      }
      // On coarse meshes there is none so near.
      if (found.path.empty()) {
        found = nearest(v, mesh::ShortestPaths::kUnreached,
                        [&](VertexId w) { return cones[at(w)] >= 4; });
      }
      if (found.path.empty()) break;
      std::vector<HalfedgeId> back(found.path.rbegin(), found.path.rend());
      for (HalfedgeId& h : back) h = adjacency.opposite[at(h)];
      move(mesh::target(surface.faces, found.path.back()), v, back);
      ++(regular ? result.spread : result.cancelled);
    }
  }
  if (result.cancelled + result.spread > 0) {
    const AngleSystem system(frames, held, std::vector<double>(held.size(), 0.0), context);
    system.relax({}, field, context);
  }
  return result;
}

}  // namespace flipfree::field
