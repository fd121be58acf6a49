#include "flipfree/distortion/seams/constraints.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/plane.h"

namespace flipfree::distortion {

namespace {

// A half-edge in the map.
Vector2 along(const CutMap& map, HalfedgeId h) {
  return map.uv.row(mesh::target(map.surface.faces, h)) -
         map.uv.row(mesh::source(map.surface.faces, h));
}

}  // namespace

CutMap cut_map(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
               const mesh::EdgeFlags& cuts, const Points2& corner_uv) {
  const mesh::CutMesh cut = mesh::cut_along(surface.faces, adjacency, cuts);
  CutMap map;
  map.surface = {surface.vertices(cut.vertex_origin, Eigen::all), cut.faces};
  map.uv.resize(map.surface.vertices.rows(), 2);
  for (auto c = static_cast<CornerId>(corner_uv.rows()) - 1; c >= 0; --c)
    map.uv.row(mesh::source(cut.faces, c)) = corner_uv.row(c);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cuts.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o < h || !cuts[at(h)]) continue;
    const Vector2 a = along(map, h), b = -along(map, o);
    // |R^k a - b| is least where their product is largest.
    const std::array<double, 4> product = {a.dot(b), cross(a, b), -a.dot(b), -cross(a, b)};
    const auto best = std::max_element(product.begin(), product.end()) - product.begin();
    map.seams.push_back({h, o, static_cast<Index>(best)});
  }
  return map;
}

std::vector<StraightEdge> straight_boundary(const CutMap& map, const mesh::Adjacency& adjacency) {
  std::vector<StraightEdge> edges;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    const Vector2 e = along(map, h);
    const std::array<double, 4> forward = {e.x(), e.y(), -e.x(), -e.y()};
    const auto best = std::max_element(forward.begin(), forward.end()) - forward.begin();
    edges.push_back({h, static_cast<Index>(best)});
  }
  return edges;
}

namespace {

using numeric::GaussianInteger;
using numeric::LinearForm;
using numeric::quarter_turn;

// Finer grids for translations than this leave too few of 24 bits.
constexpr std::int64_t kMostEliminationSteps = 4096;

// Vertex `to` is where a seam edge takes this one: to = i^turns from + unit times its translation.
struct Arc {
  VertexId to = kInvalid;
  Index turns = 0;
  Index edge = kInvalid;
  GaussianInteger unit;
};

// Both ends of every seam edge, seen from either side, by vertex.
Lists<Arc> arcs_of(Index vertex_count, const Triangles& faces, const std::vector<SeamEdge>& seams) {
  return Lists<Arc>(at(vertex_count), [&](const auto& add) {
    for (std::size_t e = 0; e < seams.size(); ++e) {
      const auto& [h, o, r] = seams[e];
      for (const auto& [from, to] : {std::pair(mesh::source(faces, h), mesh::target(faces, o)),
                                     std::pair(mesh::target(faces, h), mesh::source(faces, o))}) {
        add(from, Arc{to, r, static_cast<Index>(e), {1, 0}});
        add(to, Arc{from, -r, static_cast<Index>(e), -quarter_turn(-r)});
      }
    }
  });
}

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

// A vertex on lines, in the frame of its first copy: i^direction (along + i across).
struct Edge {
  bool on_line = false;
  Index direction = 0;
  LinearForm across;    // over real unknowns
  bool corner = false;  // of two lines: `along` is no free coordinate
  LinearForm along;
};

// The lines on which straight edges lie: those that meet in one direction at a vertex of the cut
// surface.

struct LineSide {
  Index line = kInvalid;
  Index direction = 0;  // in which the edge runs on it
};

struct StraightLines {
  std::vector<std::vector<LineSide>> sides;  // per cut vertex: of the straight edges at it
  // Per line: its vertices, with the direction in which it runs; some twice.
  std::vector<std::vector<std::pair<VertexId, Index>>> vertices;
};

// Cost: O(#V).
StraightLines straight_lines(Index vertex_count, const Triangles& faces,
                             const std::vector<StraightEdge>& straight) {
  StraightLines lines;
  lines.sides.resize(at(vertex_count));
  // Edges first; then those that continue each other are one line.
  for (std::size_t e = 0; e < straight.size(); ++e) {
    const auto& [h, direction] = straight[e];
    for (const VertexId v : {mesh::source(faces, h), mesh::target(faces, h)})
      lines.sides[at(v)].push_back({static_cast<Index>(e), direction});
  }
  DisjointSets sets(static_cast<Index>(straight.size()));
  for (const std::vector<LineSide>& sides : lines.sides) {
    for (std::size_t i = 1; i < sides.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        if (sides[i].direction == sides[k].direction) sets.join(sides[k].line, sides[i].line);
      }
    }
  }
  std::vector<Index> number(straight.size(), kInvalid);
  for (VertexId v = 0; v < vertex_count; ++v) {
    for (LineSide& side : lines.sides[at(v)]) {
      Index& line = number[at(sets.find(side.line))];
      if (line == kInvalid) {
        line = static_cast<Index>(lines.vertices.size());
        lines.vertices.emplace_back();
      }
      side.line = line;
      lines.vertices[at(line)].emplace_back(v, side.direction);
    }
  }
  return lines;
}

class Builder {
 public:
  Builder(const CutMap& map, const ExecutionContext& context)
      : context_(context),
        vertex_count_(static_cast<Index>(map.uv.rows())),
        seam_count_(static_cast<Index>(map.seams.size())),
        at_(arcs_of(vertex_count_, map.surface.faces, map.seams)),
        copies_(at(vertex_count_)),
        cones_(at(vertex_count_)),
        real_(!map.straight.empty()),
        lines_(straight_lines(vertex_count_, map.surface.faces, map.straight)) {}

  SeamConstraints build() {
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

  void add_row(LinearForm row) {
    if (!row.empty()) rows_.push_back(std::move(row));
  }

  // The copies of one vertex of the surface, from the first one.
  void go_around(VertexId first) {
    copies_[at(first)].first = first;
    std::vector<VertexId> queue{first};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const VertexId v = queue[i];
      for (const Arc& arc : at_[v]) {
        context_.check();
        const LinearForm own{{arc.edge, arc.unit}};
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
      add_row(std::move(difference));
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
    const LinearForm row = checked(sum({}, {found.divisor, 0}, cone.form));
    add_row(checked(sum(row, {-cone.divisor, 0}, found.form)));
  }

  // With straight edges the unknowns are real: translations in two parts, then lines.
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
    for (const LinearForm& row : std::exchange(rows_, {})) {
      const LinearForm both = over_unknowns(row);
      for (const Index turn : {0, 1})
        add_row(imaginary_part(checked(sum({}, quarter_turn(turn), both))));
    }
  }

  // Vertices by the lines through them: in the first copy's frame a line of direction d is where
  // the second coordinate of i^-d z is q. A cone is where translations put it: they follow.
  void put_on_lines() {
    edges_.resize(at(vertex_count_));
    for (VertexId v = 0; v < vertex_count_; ++v) {
      const Copy& copy = copies_[at(v)];
      const Cone& cone = cones_[at(copy.first)];
      for (const LineSide& side : lines_.sides[at(v)]) {
        if (cone.divisor != 0) {
          const LinearForm place = checked(sum(checked(sum({}, {cone.divisor, 0}, copy.shift)),
                                               quarter_turn(copy.turns), cone.form));
          const LinearForm across =
              imaginary_part(checked(sum({}, quarter_turn(-side.direction), over_unknowns(place))));
          rows_.push_back(
              checked(sum(across, {-cone.divisor, 0}, {{first_line() + side.line, {1, 0}}})));
          continue;
        }
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
      add_row(checked(sum(q, {turn == 0 ? -1 : 1, 0}, edge.across)));
      return;
    }
    LinearForm along = checked(sum({}, {turn == 1 ? -1 : 1, 0}, q));
    if (edge.corner) {
      add_row(checked(sum(along, {-1, 0}, edge.along)));
      return;
    }
    edge.corner = true;
    edge.along = std::move(along);
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
    for (Index u = 0; u < unknowns; ++u) {
      if (!solved.free[at(u)]) continue;
      node_of[at(u)] = out.node_count();
      out.translation.push_back({{}, real_ && u >= first_line() ? u - first_line() : kInvalid});
      out.real.push_back(real_ ? 1 : 0);
    }
    // Edges whose translation is that of a node, but for a unit, tell it.
    const Index parts = real_ ? 2 : 1;
    for (Index u = 0; u < parts * seam_count_; ++u) {
      const auto& [form, divisor] = solved.value[at(u)];
      if (form.size() != 1 || divisor != 1 || !form[0].factor.is_unit()) continue;
      Index turns = u % parts;
      while (!(quarter_turn(turns - u % parts) == form[0].factor)) ++turns;
      const Index node = node_of[at(form[0].unknown)] - out.position_count();
      out.translation[at(node)].edges.emplace_back(u / parts, turns);
    }
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
  Lists<Arc> at_;  // by vertex
  std::vector<Copy> copies_;
  std::vector<Cone> cones_;  // by first copy
  std::vector<LinearForm> rows_;
  bool real_;  // are the unknowns
  StraightLines lines_;
  std::vector<Edge> edges_;  // by first copy
};

}  // namespace

std::pair<Index, Index> SeamConstraints::position_of(VertexId v) const {
  for (Index t = begin[at(v)]; t < begin[at(v) + 1]; ++t) {
    const auto& [node, factor] = terms[at(t)];
    if (node >= position_count()) continue;
    // The factor is a unit times the divisor.
    return {node, factor.re > 0 ? 0 : factor.im > 0 ? 1 : factor.re < 0 ? 2 : 3};
  }
  return {kInvalid, 0};
}

SeamConstraints eliminate_seams(const CutMap& map, const ExecutionContext& context) {
  return Builder(map, context).build();
}

namespace {

// factor times (x, y), as complex numbers.
Vector2 product(const GaussianInteger& factor, const Vector2& p) {
  const auto re = static_cast<double>(factor.re);
  const auto im = static_cast<double>(factor.im);
  return {re * p.x() - im * p.y(), re * p.y() + im * p.x()};
}

}  // namespace

Points2 nodes_of(const SeamConstraints& constraints, const CutMap& map, const Points2& uv) {
  Points2 nodes = Points2::Zero(constraints.node_count(), 2);
  const auto turned_back = [&](VertexId v, Index direction) {
    return product(quarter_turn(-direction), uv.row(v).transpose());
  };
  for (Index n = 0; n < constraints.position_count(); ++n) {
    nodes.row(n) = turned_back(constraints.position[at(n)], constraints.direction[at(n)]);
    if (constraints.real[at(n)]) nodes(n, 1) = 0;
  }
  const auto shift_across = [&](Index e) -> Vector2 {
    const auto point = [&](CornerId c) -> Vector2 {
      return uv.row(mesh::source(map.surface.faces, c)).transpose();
    };
    const auto& [h, o, r] = map.seams[at(e)];
    const GaussianInteger turn = quarter_turn(r);
    return 0.5 * (point(next_corner(o)) - product(turn, point(h)) + point(o) -
                  product(turn, point(next_corner(h))));
  };
  for (std::size_t t = 0; t < constraints.translation.size(); ++t) {
    const auto& [edges, line] = constraints.translation[t];
    const Index n = constraints.position_count() + static_cast<Index>(t);
    Vector2 sum = Vector2::Zero();
    double count = static_cast<double>(edges.size());
    if (line == kInvalid) {
      for (const auto& [e, turns] : edges) sum += product(quarter_turn(-turns), shift_across(e));
    } else {
      count = static_cast<double>(constraints.lines[at(line)].size());
      for (const auto& [v, direction] : constraints.lines[at(line)])
        sum.x() += turned_back(v, direction).y();
    }
    nodes.row(n) = (sum / count).transpose();
    if (constraints.real[at(n)]) nodes(n, 1) = 0;
  }
  return nodes;
}

Points2 map_of(const SeamConstraints& constraints, const Points2& nodes) {
  const std::size_t count = constraints.divisor.size();
  Points2 uv(static_cast<Eigen::Index>(count), 2);
  for (std::size_t v = 0; v < count; ++v) {
    Vector2 total = Vector2::Zero();
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const NodeTerm& term = constraints.terms[at(t)];
      total += product(term.factor, nodes.row(term.node).transpose());
    }
    uv.row(static_cast<Eigen::Index>(v)) =
        total.transpose() / static_cast<double>(constraints.divisor[v]);
  }
  return uv;
}

}  // namespace flipfree::distortion
