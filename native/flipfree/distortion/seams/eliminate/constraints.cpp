#include "flipfree/distortion/seams/eliminate/constraints.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/distortion/seams/eliminate/arcs.h"
#include "flipfree/distortion/seams/eliminate/branches.h"
#include "flipfree/distortion/seams/eliminate/straight_lines.h"

namespace flipfree::distortion {
namespace {

using numeric::GaussianInteger;
using numeric::LinearForm;
using numeric::quarter_turn;

// Finer grids for translations than this leave too few of 24 bits.
constexpr std::int64_t kMostEliminationSteps = 4096;

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

// A boundary vertex on lines, in the frame of its first copy: i^direction (along + i across).
struct Edge {
  bool on_line = false;
  Index direction = 0;
  LinearForm across;    // over real unknowns
  bool corner = false;  // of two lines: `along` is no free coordinate
  LinearForm along;
};

class Builder {
 public:
  Builder(Index vertex_count, const Triangles& faces, const std::vector<SeamEdge>& seams,
          const std::vector<StraightEdge>& straight, const ExecutionContext& context)
      : context_(context),
        vertex_count_(vertex_count),
        seam_count_(static_cast<Index>(seams.size())),
        arcs_(list_arcs(vertex_count, faces, seams)),
        branches_(seams.size()),
        copies_(at(vertex_count)),
        cones_(at(vertex_count)),
        real_(!straight.empty()),
        lines_(straight_lines(vertex_count, faces, straight)) {}

  SeamConstraints build() {
    index_arcs();
    join_chains();
    for (VertexId v = 0; v < vertex_count_; ++v) {
      if (v % 65536 == 0) context_.check();
      if (copies_[at(v)].first == kInvalid) go_around(v);
    }
    Index unknowns = seam_count_;
    if (real_) {
      split_rows();
      put_on_lines();
      unknowns = first_line() + static_cast<Index>(lines_.vertices.size());
    }
    const auto solved = numeric::eliminate(unknowns, rows_, context_);
    if (!solved) too_large();
    return assemble(*solved, unknowns);
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
    offset_.assign(at(vertex_count_) + 1, 0);
    for (const Arc& a : arcs_) {
      ++offset_[at(a.from) + 1];
      ++offset_[at(a.to) + 1];
    }
    for (std::size_t v = 0; v < at(vertex_count_); ++v) offset_[v + 1] += offset_[v];
    at_.resize(at(offset_.back()));
    std::vector<Index> next(offset_.begin(), offset_.end() - 1);
    for (const Arc& a : arcs_) {
      at_[at(next[at(a.from)]++)] = {a.to, a.turns, a.edge, {1, 0}};
      at_[at(next[at(a.to)]++)] = {a.from, -a.turns, a.edge, -quarter_turn(-a.turns)};
    }
  }

  // Two copies that two seam edges relate by the same turn: the edges have one translation.
  void join_chains() {
    for (VertexId v = 0; v < vertex_count_; ++v) {
      if (offset_[at(v) + 1] - offset_[at(v)] != 2) continue;
      const DirectedArc& a = at_[at(offset_[at(v)])];
      const DirectedArc& b = at_[at(offset_[at(v)]) + 1];
      const bool pair = a.to == b.to && v < a.to && (a.turns - b.turns) % 4 == 0 &&
                        offset_[at(a.to) + 1] - offset_[at(a.to)] == 2;
      if (!pair) continue;
      // a.unit t_a = b.unit t_b
      const GaussianInteger inverse{a.unit.re, -a.unit.im};
      LinearForm form = branches_.join(a.edge, inverse * b.unit, b.edge);
      if (!form.empty()) rows_.push_back(std::move(form));
    }
  }

  // The copies of one vertex of the surface, from the first one.
  void go_around(VertexId first) {
    copies_[at(first)].first = first;
    std::vector<VertexId> queue{first};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const VertexId v = queue[i];
      for (Index k = offset_[at(v)]; k < offset_[at(v) + 1]; ++k) {
        context_.check();
        const DirectedArc& arc = at_[at(k)];
        const auto [root, unit] = branches_.root(arc.edge);
        const LinearForm own{{root, arc.unit * unit}};
        const Copy& from = copies_[at(v)];
        const Index turns = from.turns + arc.turns;
        LinearForm shift = checked(sum(own, quarter_turn(arc.turns), from.shift));
        Copy& to = copies_[at(arc.to)];
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
    Cone& cone = cones_[at(first)];
    if (cone.divisor == 0) {
      cone = std::move(found);
      return;
    }
    LinearForm row = checked(sum({}, {found.divisor, 0}, cone.form));
    row = checked(sum(row, {-cone.divisor, 0}, found.form));
    if (!row.empty()) rows_.push_back(std::move(row));
  }

  // With a straight boundary the unknowns are real: translations in two parts, then lines.
  Index first_line() const { return 2 * seam_count_; }
  LinearForm over_unknowns(const LinearForm& form) const {
    if (!real_) return form;
    LinearForm out;
    for (const numeric::Term& t : form) {
      out.push_back({2 * t.unknown, t.factor});
      out.push_back({2 * t.unknown + 1, quarter_turn(1) * t.factor});
    }
    return out;
  }
  static LinearForm imaginary_part(const LinearForm& form) {
    LinearForm out;
    for (const numeric::Term& t : form) {
      if (t.factor.im != 0) out.push_back({t.unknown, {t.factor.im, 0}});
    }
    return out;
  }
  void split_rows() {
    std::vector<LinearForm> rows;
    for (const LinearForm& row : rows_) {
      const LinearForm both = over_unknowns(row);
      for (const Index turn : {0, 1}) {
        LinearForm part = imaginary_part(checked(sum({}, quarter_turn(turn), both)));
        if (!part.empty()) rows.push_back(std::move(part));
      }
    }
    rows_ = std::move(rows);
  }

  // Boundary vertices by the lines through them: in the first copy's frame a line of direction d is
  // where the second coordinate of i^-d z is q.
  void put_on_lines() {
    edges_.resize(at(vertex_count_));
    for (VertexId v = 0; v < vertex_count_; ++v) {
      const Copy& copy = copies_[at(v)];
      for (const LineSide& side : lines_.sides[at(v)]) {
        if (side.line == kInvalid) continue;
        const LinearForm shift = imaginary_part(
            checked(sum({}, quarter_turn(-side.direction), over_unknowns(copy.shift))));
        LinearForm q = checked(sum({{first_line() + side.line, {1, 0}}}, {-1, 0}, shift));
        meet(edges_[at(copy.first)], side.direction - copy.turns, std::move(q));
      }
    }
  }
  void meet(Edge& edge, Index direction, LinearForm q) {
    if (!edge.on_line) {
      edge.on_line = true;
      edge.direction = direction;
      edge.across = std::move(q);
      return;
    }
    const Index turn = (((direction - edge.direction) % 4) + 4) % 4;
    if (turn % 2 == 0) {
      LinearForm row = checked(sum(q, {turn == 0 ? -1 : 1, 0}, edge.across));
      if (!row.empty()) rows_.push_back(std::move(row));
      return;
    }
    edge.corner = true;
    edge.along = checked(sum({}, {turn == 1 ? -1 : 1, 0}, q));
  }
  // i^direction (along + i across), without a free coordinate along the line.
  LinearForm place_of(const Edge& edge) const {
    const LinearForm place = checked(sum(edge.along, quarter_turn(1), edge.across));
    return checked(sum({}, quarter_turn(edge.direction), place));
  }

  // form over unknowns -> form over free branches, divided by `divisor`, in lowest terms.
  numeric::Elimination::Value substitute(const LinearForm& form, std::int64_t divisor,
                                         const numeric::Elimination& solved) const {
    std::int64_t common = 1;
    for (const numeric::Term& t : form)
      common = std::lcm(common, solved.value[at(t.unknown)].divisor);
    if (common > kMostEliminationSteps) too_large();
    numeric::Elimination::Value out;
    for (const numeric::Term& t : form) {
      context_.check();  // either may have as many terms as there are branches
      const auto& v = solved.value[at(t.unknown)];
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

  // Positions, then translations and lines that are free; returns the node of each unknown.
  std::vector<Index> number_nodes(const numeric::Elimination& solved, Index unknowns,
                                  std::vector<Index>& node_of_vertex, SeamConstraints& out) {
    for (VertexId v = 0; v < vertex_count_; ++v) {
      if (copies_[at(v)].first != v || cones_[at(v)].divisor != 0) continue;
      const bool on_line = real_ && edges_[at(v)].on_line;
      if (on_line && edges_[at(v)].corner) continue;
      node_of_vertex[at(v)] = out.position_count();
      out.position.push_back(v);
      out.direction.push_back(on_line ? edges_[at(v)].direction : 0);
      out.real.push_back(on_line ? 1 : 0);
    }
    std::vector<Index> node_of(at(unknowns), kInvalid);
    const auto add = [&](Index unknown, Index place, ShiftSource::Part part) {
      if (!solved.free[at(unknown)]) return;
      node_of[at(unknown)] = out.node_count();
      out.translation.push_back({place, part});
      out.real.push_back(part == ShiftSource::Part::kWhole ? 0 : 1);
    };
    for (Index e = 0; e < seam_count_; ++e) {
      const auto [root, unit] = branches_.root(e);
      out.branch.push_back(root);
      out.branch_unit.push_back(unit);
      if (root != e) continue;
      if (!real_) {
        add(e, e, ShiftSource::Part::kWhole);
        continue;
      }
      add(2 * e, e, ShiftSource::Part::kReal);
      add(2 * e + 1, e, ShiftSource::Part::kImaginary);
    }
    for (Index line = 0; line < static_cast<Index>(lines_.vertices.size()); ++line)
      add(first_line() + line, line, ShiftSource::Part::kLine);
    out.lines = lines_.vertices;
    return node_of;
  }

  SeamConstraints assemble(const numeric::Elimination& solved, Index unknowns) {
    SeamConstraints out;
    std::vector<Index> node_of_vertex(at(vertex_count_), kInvalid);
    const std::vector<Index> node_of_unknown = number_nodes(solved, unknowns, node_of_vertex, out);
    out.begin.reserve(at(vertex_count_) + 1);
    out.divisor.reserve(at(vertex_count_));
    out.begin.push_back(0);
    for (VertexId v = 0; v < vertex_count_; ++v) {
      const Copy& copy = copies_[at(v)];
      const Cone& cone = cones_[at(copy.first)];
      const Index node = node_of_vertex[at(copy.first)];
      const Edge* edge =
          real_ && edges_[at(copy.first)].on_line ? &edges_[at(copy.first)] : nullptr;
      const Index turns = copy.turns + (edge != nullptr && node != kInvalid ? edge->direction : 0);
      if (node != kInvalid) out.terms.push_back({node, quarter_turn(turns)});
      std::int64_t divisor = 1;
      if (cone.divisor != 0 || edge != nullptr || !copy.shift.empty()) {
        const std::int64_t d = cone.divisor != 0 ? cone.divisor : 1;
        LinearForm form = checked(sum({}, {d, 0}, copy.shift));
        if (cone.divisor != 0) form = checked(sum(form, quarter_turn(copy.turns), cone.form));
        form = over_unknowns(form);
        if (edge != nullptr) form = checked(sum(form, quarter_turn(copy.turns), place_of(*edge)));
        const auto value = substitute(form, d, solved);
        divisor = value.divisor;
        if (node != kInvalid)
          out.terms.back().factor = out.terms.back().factor * GaussianInteger{divisor, 0};
        for (const numeric::Term& t : value.form)
          out.terms.push_back({node_of_unknown[at(t.unknown)], t.factor});
      }
      out.divisor.push_back(divisor);
      out.begin.push_back(static_cast<Index>(out.terms.size()));
      out.translation_step = std::lcm(out.translation_step, divisor);
      if (out.translation_step > kMostEliminationSteps) too_large();
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
  bool real_;  // are the unknowns
  StraightLines lines_;
  std::vector<Edge> edges_;  // by first copy
};

}  // namespace

SeamConstraints eliminate_seams(Index vertex_count, const Triangles& faces,
                                const std::vector<SeamEdge>& seams,
                                const std::vector<StraightEdge>& straight,
                                const ExecutionContext& context) {
  return Builder(vertex_count, faces, seams, straight, context).build();
}

SeamConstraints eliminate_seams(Index vertex_count, const Triangles& faces,
                                const std::vector<SeamEdge>& seams,
                                const ExecutionContext& context) {
  return eliminate_seams(vertex_count, faces, seams, {}, context);
}

}  // namespace flipfree::distortion
