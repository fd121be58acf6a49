#include "flipfree/seamless/padding/segments.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/cholesky/laplacian_factor.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

namespace {

// The sides of a cut as a permutation.
class BoundarySides {
 public:
  explicit BoundarySides(const AdmissibleCut& cut)
      : opposite_(cut.surface.adjacency().opposite), cut_(cut), side_(opposite_.size(), kInvalid) {
    for (std::size_t b = 0; b < cut.branches.size(); ++b) {
      if (cut.branches[b].empty()) throw InternalError("a branch without edges");
      for (const HalfedgeId h : cut.branches[b]) {
        claim(h, static_cast<Index>(2 * b));
        claim(opposite_[at(h)], static_cast<Index>(2 * b + 1));
      }
    }
    for (const HalfedgeId h : cut.flat_sectors) {
      if (side_[at(h)] == kInvalid || first(side_[at(h)]) != h)
        throw InternalError("a flat sector that does not begin with a branch");
    }
  }

  Index count() const { return static_cast<Index>(2 * cut_.branches.size()); }
  bool on_branch(HalfedgeId h) const { return side_[at(h)] != kInvalid; }
  HalfedgeId first(Index side) const {
    const std::vector<HalfedgeId>& branch = cut_.branches[at(side / 2)];
    return side % 2 == 0 ? branch.front() : opposite_[at(branch.back())];
  }
  // The side that follows on the boundary, surface on the left.
  Index next(Index side) const {
    const std::vector<HalfedgeId>& branch = cut_.branches[at(side / 2)];
    const HalfedgeId last = side % 2 == 0 ? branch.back() : opposite_[at(branch.front())];
    HalfedgeId h = next_corner(last);
    while (!on_branch(h)) h = next_corner(opposite_[at(h)]);
    const Index following = side_[at(h)];
    if (first(following) != h) throw InternalError("a branch that ends on another one's inside");
    return following;
  }

 private:
  void claim(HalfedgeId h, Index side) {
    if (side_[at(h)] != kInvalid) throw InternalError("two branches share an edge");
    side_[at(h)] = side;
  }

  const std::vector<HalfedgeId>& opposite_;
  const AdmissibleCut& cut_;
  std::vector<Index> side_;  // per half-edge
};

// Flags of the half-edges on branches.
mesh::EdgeFlags branch_edges(const AdmissibleCut& cut) {
  const std::vector<HalfedgeId>& opposite = cut.surface.adjacency().opposite;
  mesh::EdgeFlags flags(opposite.size(), 0);
  for (const auto& branch : cut.branches) {
    for (const HalfedgeId h : branch) flags[at(h)] = flags[at(opposite[at(h)])] = 1;
  }
  return flags;
}

// Cotangent weights are kept between these: a needle is not to decide.
constexpr double kLeastWeight = 0.01;
constexpr double kMostWeight = 100.0;

// Scale factors u by which angles become others to first order, zero at the last vertex, and the
// cotangent weights of edges, per half-edge.
struct LinearScale {
  std::vector<double> u, weight;
};

// `angle`: per vertex, radians, of the right sum.
LinearScale linear_scale(const mesh::Surface& surface, const std::vector<double>& angle,
                         ExecutionContext& context) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  LinearScale found{angle, std::vector<double>(adjacency.opposite.size(), 0.0)};
  auto& [u, weight] = found;
  const auto place = [&](HalfedgeId h) -> Vector3 {
    return surface.vertices.row(mesh::source(surface.faces, h));
  };
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const HalfedgeId beyond = next_corner(h);  // the edge opposite of the corner
    const HalfedgeId back = adjacency.opposite[at(beyond)];
    const Vector3 a = place(beyond) - place(h), b = place(previous_corner(h)) - place(h);
    const double dot = a.dot(b), cross = a.cross(b).norm();
    u[at(mesh::source(surface.faces, h))] -= std::atan2(cross, dot);
    weight[at(beyond)] += 0.5 * dot / std::max(cross, 1e-300);
    if (back != kInvalid) weight[at(back)] += 0.5 * dot / std::max(cross, 1e-300);
  }
  for (double& w : weight)
    w = std::isfinite(w) ? std::clamp(w, kLeastWeight, kMostWeight) : kLeastWeight;
  std::vector<numeric::Coupling> couplings;
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const auto [low, high] =
        std::minmax({mesh::source(surface.faces, h), mesh::target(surface.faces, h)});
    const HalfedgeId back = adjacency.opposite[at(h)];
    if (back == kInvalid || h < back) couplings.push_back({low, high, weight[at(h)]});
  }
  std::sort(couplings.begin(), couplings.end(), [](const auto& a, const auto& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  numeric::LaplacianFactor factor;
  if (!factor.factorize(static_cast<Index>(u.size()), couplings, context)) {
    throw_not_converged(ErrorCode::kFactorizationFailed,
                        "The cut of the engine \"padding\" found no flat angles of the surface. "
                        "Remove degenerate faces, or take the engine \"penner\".");
  }
  factor.solve(u, context);
  return found;
}

}  // namespace

Index CutSegments::next(Index segment) const {
  const Index component = segments[at(segment)].component;
  return segment + 1 < first[at(component) + 1] ? segment + 1 : first[at(component)];
}

Index CutSegments::previous(Index segment) const {
  const Index component = segments[at(segment)].component;
  return segment > first[at(component)] ? segment - 1 : first[at(component) + 1] - 1;
}

std::vector<HalfedgeId> side_halfedges(const AdmissibleCut& cut, Index side) {
  std::vector<HalfedgeId> halfedges = cut.branches[at(side / 2)];
  if (side % 2 == 0) return halfedges;
  std::reverse(halfedges.begin(), halfedges.end());
  for (HalfedgeId& h : halfedges) h = cut.surface.adjacency().opposite[at(h)];
  return halfedges;
}

CutSegments cut_segments(const AdmissibleCut& cut) {
  const BoundarySides sides(cut);
  CutSegments result;
  const mesh::Components components =
      mesh::components_between(cut.surface.adjacency(), branch_edges(cut));
  result.of_side.assign(at(sides.count()), kInvalid);
  std::vector<char> flat(at(sides.count()), 0);  // is there a flat sector before the side
  for (Index s = 0; s < sides.count(); ++s) {
    flat[at(s)] = std::count(cut.flat_sectors.begin(), cut.flat_sectors.end(), sides.first(s)) > 0;
  }
  std::vector<Index> start(at(components.count), kInvalid);
  for (Index s = sides.count() - 1; s >= 0; --s) {
    if (flat[at(s)] == 0) start[at(components.of_face[at(sides.first(s) / 3)])] = s;
  }
  for (Index c = 0; c < components.count; ++c) {
    result.first.push_back(static_cast<Index>(result.segments.size()));
    if (start[at(c)] == kInvalid) throw InternalError("a component of the cut has no corner");
    Index s = start[at(c)];
    do {
      if (flat[at(s)] == 0) result.segments.push_back({c, {}});
      result.segments.back().sides.push_back(s);
      result.of_side[at(s)] = static_cast<Index>(result.segments.size()) - 1;
      s = sides.next(s);
    } while (s != start[at(c)]);
  }
  result.first.push_back(static_cast<Index>(result.segments.size()));
  if (std::count(result.of_side.begin(), result.of_side.end(), kInvalid) > 0)
    throw InternalError("a component of the cut has several boundary loops");
  return result;
}

std::vector<EqualizationRow> equalization_rows(const CutSegments& segments) {
  std::vector<EqualizationRow> rows;
  for (Index i = 0; at(i) < segments.segments.size(); ++i) {
    EqualizationRow row;
    row.segment = i;
    for (const Index side : segments.segments[at(i)].sides)
      row.mates.push_back(segments.of_side[at(mate_of(side))]);
    const auto mates_sides = [&](Index j) { return segments.segments[at(j)].sides.size(); };
    if (row.mates.size() == 1) {
      // The complex one of the two has the row; of two simple ones the first.
      const Index j = row.mates.front();
      if (mates_sides(j) > 1 || j < i) continue;
    } else if (std::any_of(row.mates.begin(), row.mates.end(),
                           [&](Index j) { return mates_sides(j) > 1; })) {
      throw InternalError("both sides of a branch lie at flat sectors");
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<CutPiece> cut_pieces(const AdmissibleCut& cut, const CutSegments& segments,
                                 const std::vector<Index>& cones) {
  const mesh::EdgeFlags flags = branch_edges(cut);
  const mesh::CutMesh open = mesh::cut_along(cut.surface.faces, cut.surface.adjacency(), flags);
  std::vector<double> angle;
  for (const VertexId v : open.vertex_origin) angle.push_back(cones[at(v)] * kQuarterTurn);
  const auto set = [&](HalfedgeId h, double quarters) {
    angle[at(open.faces(h / 3, h % 3))] = quarters * kQuarterTurn;
  };
  for (HalfedgeId h = 0; at(h) < flags.size(); ++h) {
    if (flags[at(h)]) set(h, 2.0);
  }
  for (const CutSegment& segment : segments.segments)
    set(side_halfedges(cut, segment.sides.front()).front(), 1.0);
  std::vector<CutPiece> pieces;
  for (mesh::Chart& chart : mesh::split_into_charts(cut.surface.vertices, open)) {
    CutPiece& piece = pieces.emplace_back(CutPiece{std::move(chart), {}});
    for (const VertexId v : piece.chart.vertices) piece.angle.push_back(angle[at(v)]);
  }
  return pieces;
}

std::vector<double> flat_crossings(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   ExecutionContext& context) {
  std::vector<double> angle;
  for (const Index k : cones) angle.push_back(k * kQuarterTurn);
  auto [u, crossings] = linear_scale(surface, angle, context);
  for (HalfedgeId h = 0; at(h) < crossings.size(); ++h) {
    crossings[at(h)] *=
        u[at(mesh::source(surface.faces, h))] - u[at(mesh::target(surface.faces, h))];
  }
  return crossings;
}

double scale_range(const AdmissibleCut& cut, std::vector<Index> cones, ExecutionContext& context) {
  cones.resize(at(cut.surface.vertices.rows()), kFlat);
  double range = 0.0;
  for (const auto& [chart, angle] : cut_pieces(cut, cut_segments(cut), cones)) {
    const std::vector<double> u = linear_scale(chart.surface, angle, context).u;
    const auto [low, high] = std::minmax_element(u.begin(), u.end());
    range = std::max(range, *high - *low);
  }
  return range;
}

}  // namespace flipfree::seamless
