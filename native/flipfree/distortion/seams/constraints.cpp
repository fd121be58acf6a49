#include "flipfree/distortion/seams/constraints.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::distortion {
namespace {

using numeric::GaussianInteger;
using numeric::LinearForm;
using numeric::quarter_turn;

// Finer grids for translations than this leave too few of 24 bits.
constexpr std::int64_t kMostSteps = 4096;

std::size_t size(Index i) { return static_cast<std::size_t>(i); }

// to = i^turns from + (unit of the edge) times its translation.
struct Arc {
  VertexId from = kInvalid;
  VertexId to = kInvalid;
  Index turns = 0;
  Index edge = kInvalid;
};
// The same from the other end: from = i^-turns to - i^-turns t.
struct DirectedArc {
  VertexId to = kInvalid;
  Index turns = 0;
  Index edge = kInvalid;
  GaussianInteger unit;
};

VertexId corner_vertex(const Triangles& faces, CornerId c) { return faces(c / 3, c % 3); }

// Both ends of every seam edge.
std::vector<Arc> list_arcs(Index vertex_count, const Triangles& faces,
                           const std::vector<SeamEdge>& seams) {
  std::vector<Arc> arcs;
  arcs.reserve(2 * seams.size());
  const auto corners = static_cast<HalfedgeId>(3 * faces.rows());
  for (std::size_t e = 0; e < seams.size(); ++e) {
    const auto& [h, o, r] = seams[e];
    if (h < 0 || o < 0 || h >= corners || o >= corners || h == o) {
      throw_invalid(ErrorCode::kBadOption,
                    "Seam edge " + std::to_string(e) +
                        " names half-edges that do not exist, or one twice. Name the two sides of "
                        "a cut edge.");
    }
    const auto edge = static_cast<Index>(e);
    arcs.push_back({corner_vertex(faces, h), corner_vertex(faces, next_corner(o)), r, edge});
    arcs.push_back({corner_vertex(faces, next_corner(h)), corner_vertex(faces, o), r, edge});
  }
  for (const Arc& a : arcs) {
    if (a.from < 0 || a.to < 0 || a.from >= vertex_count || a.to >= vertex_count) {
      throw_invalid(ErrorCode::kIndexOutOfRange,
                    "A face at a seam edge names a vertex that does not exist. Correct the faces.",
                    ElementKind::kFace, {seams[size(a.edge)].h / 3});
    }
  }
  return arcs;
}

// Seam edges with one translation: t of an edge is its unit times t of the root.
class Branches {
 public:
  explicit Branches(std::size_t count) : parent_(count), unit_(count, {1, 0}) {
    std::iota(parent_.begin(), parent_.end(), Index{0});
  }
  std::pair<Index, GaussianInteger> root(Index e) {
    GaussianInteger unit{1, 0};
    Index top = e;
    while (parent_[size(top)] != top) {
      unit = unit * unit_[size(top)];
      top = parent_[size(top)];
    }
    // Path compression.
    GaussianInteger rest = unit;
    while (parent_[size(e)] != top && e != top) {
      const Index next = parent_[size(e)];
      const GaussianInteger own = unit_[size(e)];
      parent_[size(e)] = top;
      unit_[size(e)] = rest;
      rest = rest * conjugate(own);
      e = next;
    }
    return {top, unit};
  }
  // t of e = unit times t of f. Otherwise known already: the two as a form that must be zero.
  LinearForm join(Index e, const GaussianInteger& unit, Index f) {
    const auto [p, a] = root(e);
    const auto [q, b] = root(f);
    if (p == q) {
      LinearForm form{{p, a}, {p, -(unit * b)}};
      numeric::normalise(form);
      return form;
    }
    // a t_p = unit b t_q; the lower number stays the root.
    if (p > q) {
      parent_[size(p)] = q;
      unit_[size(p)] = conjugate(a) * unit * b;
    } else {
      parent_[size(q)] = p;
      unit_[size(q)] = conjugate(unit * b) * a;
    }
    return {};
  }

 private:
  static GaussianInteger conjugate(const GaussianInteger& a) { return {a.re, -a.im}; }
  std::vector<Index> parent_;
  std::vector<GaussianInteger> unit_;
};

// A vertex of the cut surface before the elimination: (i^turns z + shift) / divisor, z the position
// of the first copy, or nothing if that is a cone's.
struct Copy {
  VertexId first = kInvalid;
  Index turns = 0;
  LinearForm shift;  // over seam edges that are roots of their branch
};
struct Cone {
  LinearForm form;
  std::int64_t divisor = 0;  // 0: no cone, free
};

class Builder {
 public:
  Builder(Index vertex_count, const Triangles& faces, const std::vector<SeamEdge>& seams,
          const ExecutionContext& context)
      : context_(context),
        vertex_count_(vertex_count),
        seam_count_(static_cast<Index>(seams.size())),
        arcs_(list_arcs(vertex_count, faces, seams)),
        branches_(seams.size()),
        copies_(size(vertex_count)),
        cones_(size(vertex_count)) {}

  SeamConstraints build() {
    index_arcs();
    join_chains();
    for (VertexId v = 0; v < vertex_count_; ++v) {
      if (v % 65536 == 0) context_.check();
      if (copies_[size(v)].first == kInvalid) go_around(v);
    }
    const auto solved = numeric::eliminate(seam_count_, rows_, context_);
    if (!solved) too_large();
    return assemble(*solved);
  }

 private:
  [[noreturn]] static void too_large() {
    throw_not_converged(ErrorCode::kFactorizationFailed,
                        "The translations across the seams depend on each other through numbers "
                        "that are too large. Cut the surface by fewer seams.");
  }
  static LinearForm checked(std::optional<LinearForm> form) {
    if (!form) too_large();
    return std::move(*form);
  }

  void index_arcs() {
    offset_.assign(size(vertex_count_) + 1, 0);
    for (const Arc& a : arcs_) {
      ++offset_[size(a.from) + 1];
      ++offset_[size(a.to) + 1];
    }
    for (std::size_t v = 0; v < size(vertex_count_); ++v) offset_[v + 1] += offset_[v];
    at_.resize(size(offset_.back()));
    std::vector<Index> next(offset_.begin(), offset_.end() - 1);
    for (const Arc& a : arcs_) {
      at_[size(next[size(a.from)]++)] = {a.to, a.turns, a.edge, {1, 0}};
      at_[size(next[size(a.to)]++)] = {a.from, -a.turns, a.edge, -quarter_turn(-a.turns)};
    }
  }

  // Two copies that two seam edges relate by the same turn: the edges have one translation.
  void join_chains() {
    for (VertexId v = 0; v < vertex_count_; ++v) {
      if (offset_[size(v) + 1] - offset_[size(v)] != 2) continue;
      const DirectedArc& a = at_[size(offset_[size(v)])];
      const DirectedArc& b = at_[size(offset_[size(v)]) + 1];
      const bool pair = a.to == b.to && v < a.to && (a.turns - b.turns) % 4 == 0 &&
                        offset_[size(a.to) + 1] - offset_[size(a.to)] == 2;
      if (!pair) continue;
      // a.unit t_a = b.unit t_b
      const GaussianInteger inverse{a.unit.re, -a.unit.im};
      LinearForm form = branches_.join(a.edge, inverse * b.unit, b.edge);
      if (!form.empty()) rows_.push_back(std::move(form));
    }
  }

  // The copies of one vertex of the surface, from the first one.
  void go_around(VertexId first) {
    copies_[size(first)].first = first;
    std::vector<VertexId> queue{first};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const VertexId v = queue[i];
      for (Index k = offset_[size(v)]; k < offset_[size(v) + 1]; ++k) {
        const DirectedArc& arc = at_[size(k)];
        const auto [root, unit] = branches_.root(arc.edge);
        const LinearForm own{{root, arc.unit * unit}};
        const Copy& from = copies_[size(v)];
        const Index turns = from.turns + arc.turns;
        LinearForm shift = checked(sum(own, quarter_turn(arc.turns), from.shift));
        Copy& to = copies_[size(arc.to)];
        if (to.first == kInvalid) {
          to = {first, turns, std::move(shift)};
          queue.push_back(arc.to);
        } else {
          close(first, turns, shift, to);
        }
      }
    }
  }

  // i^turns z + shift = i^to.turns z + to.shift.
  void close(VertexId first, Index turns, const LinearForm& shift, const Copy& to) {
    LinearForm difference = checked(sum(to.shift, {-1, 0}, shift));
    const GaussianInteger factor = quarter_turn(turns) + -quarter_turn(to.turns);
    if (factor.is_zero()) {
      if (!difference.empty()) rows_.push_back(std::move(difference));
      return;
    }
    // z = difference / factor.
    const std::int64_t norm = factor.re * factor.re + factor.im * factor.im;
    const GaussianInteger conjugate{factor.re, -factor.im};
    Cone found{checked(sum({}, conjugate, difference)), norm};
    if (norm == 4) {  // factor is +-2 or +-2 i
      found.divisor = 2;
      for (numeric::Term& t : found.form) t.factor = {t.factor.re / 2, t.factor.im / 2};
    }
    Cone& cone = cones_[size(first)];
    if (cone.divisor == 0) {
      cone = std::move(found);
      return;
    }
    LinearForm row = checked(sum({}, {found.divisor, 0}, cone.form));
    row = checked(sum(row, {-cone.divisor, 0}, found.form));
    if (!row.empty()) rows_.push_back(std::move(row));
  }

  // form over branches -> form over free branches, divided by `divisor`, in lowest terms.
  numeric::Elimination::Value substitute(const LinearForm& form, std::int64_t divisor,
                                         const numeric::Elimination& solved) const {
    std::int64_t common = 1;
    for (const numeric::Term& t : form)
      common = std::lcm(common, solved.value[size(t.unknown)].divisor);
    if (common > kMostSteps) too_large();
    numeric::Elimination::Value out;
    for (const numeric::Term& t : form) {
      const auto& v = solved.value[size(t.unknown)];
      const GaussianInteger times{t.factor.re * (common / v.divisor),
                                  t.factor.im * (common / v.divisor)};
      out.form = checked(sum(out.form, times, v.form));
    }
    out.divisor = divisor * common;
    std::int64_t shared = out.divisor;
    for (const numeric::Term& t : out.form)
      shared = std::gcd(shared, std::gcd(t.factor.re, t.factor.im));
    for (numeric::Term& t : out.form) t.factor = {t.factor.re / shared, t.factor.im / shared};
    out.divisor /= shared;
    return out;
  }

  SeamConstraints assemble(const numeric::Elimination& solved) {
    SeamConstraints out;
    std::vector<Index> node_of_vertex(size(vertex_count_), kInvalid);
    for (VertexId v = 0; v < vertex_count_; ++v) {
      if (copies_[size(v)].first != v || cones_[size(v)].divisor != 0) continue;
      node_of_vertex[size(v)] = out.position_count();
      out.position.push_back(v);
    }
    std::vector<Index> node_of_edge(size(seam_count_), kInvalid);
    for (Index e = 0; e < seam_count_; ++e) {
      const auto [root, unit] = branches_.root(e);
      out.branch.push_back(root);
      out.branch_unit.push_back(unit);
      if (!solved.free[size(e)] || root != e) continue;
      node_of_edge[size(e)] = out.node_count();
      out.translation.push_back(e);
    }
    out.begin.reserve(size(vertex_count_) + 1);
    out.divisor.reserve(size(vertex_count_));
    out.begin.push_back(0);
    for (VertexId v = 0; v < vertex_count_; ++v) {
      const Copy& copy = copies_[size(v)];
      const Cone& cone = cones_[size(copy.first)];
      const Index node = node_of_vertex[size(copy.first)];
      if (node != kInvalid) out.terms.push_back({node, quarter_turn(copy.turns)});
      std::int64_t divisor = 1;
      if (cone.divisor != 0 || !copy.shift.empty()) {
        const std::int64_t d = cone.divisor != 0 ? cone.divisor : 1;
        LinearForm form = checked(sum({}, {d, 0}, copy.shift));
        if (cone.divisor != 0) form = checked(sum(form, quarter_turn(copy.turns), cone.form));
        const auto value = substitute(form, d, solved);
        divisor = value.divisor;
        if (node != kInvalid)
          out.terms.back().factor = out.terms.back().factor * GaussianInteger{divisor, 0};
        for (const numeric::Term& t : value.form)
          out.terms.push_back({node_of_edge[size(t.unknown)], t.factor});
      }
      out.divisor.push_back(divisor);
      out.begin.push_back(static_cast<Index>(out.terms.size()));
      out.translation_step = std::lcm(out.translation_step, divisor);
      if (out.translation_step > kMostSteps) too_large();
    }
    return out;
  }

  const ExecutionContext& context_;
  Index vertex_count_;
  Index seam_count_;
  std::vector<Arc> arcs_;
  Branches branches_;
  std::vector<Copy> copies_;
  std::vector<Cone> cones_;  // by first copy
  std::vector<Index> offset_;
  std::vector<DirectedArc> at_;
  std::vector<LinearForm> rows_;
};

}  // namespace

SeamConstraints eliminate_seams(Index vertex_count, const Triangles& faces,
                                const std::vector<SeamEdge>& seams,
                                const ExecutionContext& context) {
  return Builder(vertex_count, faces, seams, context).build();
}

namespace {

// factor times (x, y), as complex numbers.
Vector2 product(const GaussianInteger& factor, const Vector2& p) {
  const auto re = static_cast<double>(factor.re);
  const auto im = static_cast<double>(factor.im);
  return {re * p.x() - im * p.y(), re * p.y() + im * p.x()};
}

}  // namespace

Points2 nodes_of(const SeamConstraints& constraints, const Triangles& faces,
                 const std::vector<SeamEdge>& seams, const Points2& uv) {
  Points2 nodes = Points2::Zero(constraints.node_count(), 2);
  for (Index n = 0; n < constraints.position_count(); ++n)
    nodes.row(n) = uv.row(constraints.position[size(n)]);
  std::vector<Vector2> sum(seams.size(), Vector2::Zero());
  std::vector<double> count(seams.size(), 0.0);
  for (std::size_t e = 0; e < seams.size(); ++e) {
    const auto point = [&](CornerId c) -> Vector2 {
      return uv.row(corner_vertex(faces, c)).transpose();
    };
    const auto& [h, o, r] = seams[e];
    const GaussianInteger turn = quarter_turn(r);
    const Vector2 own = 0.5 * (point(next_corner(o)) - product(turn, point(h)) + point(o) -
                               product(turn, point(next_corner(h))));
    const GaussianInteger unit = constraints.branch_unit[e];
    const std::size_t branch = size(constraints.branch[e]);
    sum[branch] += product({unit.re, -unit.im}, own);
    count[branch] += 1;
  }
  for (std::size_t t = 0; t < constraints.translation.size(); ++t) {
    const std::size_t e = size(constraints.translation[t]);
    nodes.row(constraints.position_count() + static_cast<Index>(t)) =
        (sum[e] / count[e]).transpose();
  }
  return nodes;
}

Points2 map_of(const SeamConstraints& constraints, const Points2& nodes) {
  const std::size_t count = constraints.divisor.size();
  Points2 uv(static_cast<Eigen::Index>(count), 2);
  for (std::size_t v = 0; v < count; ++v) {
    Vector2 total = Vector2::Zero();
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const NodeTerm& term = constraints.terms[size(t)];
      total += product(term.factor, nodes.row(term.node).transpose());
    }
    uv.row(static_cast<Eigen::Index>(v)) =
        total.transpose() / static_cast<double>(constraints.divisor[v]);
  }
  return uv;
}

}  // namespace flipfree::distortion
