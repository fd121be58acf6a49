#include "flipfree/seamless/seams.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::seamless {
namespace {

struct SeamBranch {
  // Half-edges of the map's surface in order, head to tail. Their own faces are the first side,
  // those of the opposite half-edges the second.
  std::vector<HalfedgeId> halfedges;
  certify::Transition
      transition;  // uv on the second side = turned uv on the first side + translation
};

// The two ends of a cut edge on both sides, as seen along half-edge h.
struct TwoSides {
  Vector2 source, target;                // first side
  Vector2 second_source, second_target;  // second side
};
TwoSides sides_of(const mesh::Adjacency& adjacency, const Points2& uv, HalfedgeId h) {
  const HalfedgeId o = adjacency.opposite[at(h)];
  return {uv.row(h), uv.row(next_corner(h)), uv.row(next_corner(o)), uv.row(o)};
}

std::complex<double> as_complex(const Vector2& v) { return {v.x(), v.y()}; }

certify::Transition fit_transition(const std::vector<HalfedgeId>& chain,
                                   const mesh::Adjacency& adjacency, const Points2& uv) {
  std::complex<double> turn = 0.0;
  for (const HalfedgeId h : chain) {
    const TwoSides s = sides_of(adjacency, uv, h);
    turn +=
        as_complex(s.second_target - s.second_source) * std::conj(as_complex(s.target - s.source));
  }
  certify::Transition transition;
  transition.quarter_turns = static_cast<Index>(std::lround(std::arg(turn) / kQuarterTurn) + 4) % 4;
  for (const HalfedgeId h : chain) {
    const TwoSides s = sides_of(adjacency, uv, h);
    transition.translation += s.second_source - turned(s.source, transition.quarter_turns);
    transition.translation += s.second_target - turned(s.target, transition.quarter_turns);
  }
  transition.translation /= 2.0 * static_cast<double>(chain.size());
  return transition;
}

// Walks along cut edges.
class Walker {
 public:
  Walker(const Triangles& faces, const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cut,
         const std::vector<VertexId>& cones)
      : faces_(faces), adjacency_(adjacency), cut_(cut), done_(cut.size(), 0) {
    degree_.assign(adjacency.vertex_halfedge.size(), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
      if (cut[at(h)] != 0) ++degree_[at(mesh::source(faces, h))];
      if (adjacency.opposite[at(h)] == kInvalid) degree_[at(mesh::source(faces, h))] += kNode;
    }
    for (const VertexId v : cones) degree_[at(v)] += kNode;
  }

  bool is_open(HalfedgeId h) const { return cut_[at(h)] != 0 && done_[at(h)] == 0; }
  bool starts_at_node(HalfedgeId h) const { return degree_[at(mesh::source(faces_, h))] != 2; }

  std::vector<HalfedgeId> walk(HalfedgeId first) {
    std::vector<HalfedgeId> chain;
    for (HalfedgeId h = first; h != kInvalid && done_[at(h)] == 0;) {
      chain.push_back(h);
      done_[at(h)] = done_[at(adjacency_.opposite[at(h)])] = 1;
      h = degree_[at(mesh::target(faces_, h))] == 2 ? onwards(h) : kInvalid;
    }
    return chain;
  }

 private:
  static constexpr Index kNode = 1'000'000;

  // The other cut half-edge out of the target of h.
  HalfedgeId onwards(HalfedgeId h) const {
    const HalfedgeId back = adjacency_.opposite[at(h)];
    HalfedgeId g = mesh::rotate_ccw(adjacency_, back);
    while (cut_[at(g)] == 0) g = mesh::rotate_ccw(adjacency_, g);
    return g;
  }

  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& cut_;
  std::vector<char> done_;
  std::vector<Index> degree_;
};

std::vector<SeamBranch> seam_branches(const certify::Parametrization& map,
                                      const std::vector<VertexId>& cones) {
  const Triangles& faces = map.surface.faces;
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const mesh::EdgeFlags cut = mesh::flag_edges(faces, adjacency, map.cut_edges);
  Walker walker(faces, adjacency, cut, cones);
  std::vector<SeamBranch> branches;
  const auto count = static_cast<HalfedgeId>(cut.size());
  const auto add = [&](HalfedgeId h) {
    SeamBranch branch{walker.walk(h), {}};
    branch.transition = fit_transition(branch.halfedges, adjacency, map.uv);
    branches.push_back(std::move(branch));
  };
  for (HalfedgeId h = 0; h < count; ++h) {
    if (walker.is_open(h) && walker.starts_at_node(h)) add(h);
  }
  // Closed chains, from their lowest vertex.
  std::vector<HalfedgeId> left;
  for (HalfedgeId h = 0; h < count; ++h) {
    if (walker.is_open(h)) left.push_back(h);
  }
  std::stable_sort(left.begin(), left.end(), [&](HalfedgeId a, HalfedgeId b) {
    return mesh::source(faces, a) < mesh::source(faces, b);
  });
  for (const HalfedgeId h : left) {
    if (walker.is_open(h)) add(h);
  }
  return branches;
}

}  // namespace

void turn_to_axes(const std::vector<Index>& chart_of_face, Index charts,
                  const std::function<bool(HalfedgeId)>& counts, Points2& corner_uv) {
  std::vector<std::complex<double>> turn(at(charts), 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(corner_uv.rows()); ++h) {
    const Vector2 along = corner_uv.row(next_corner(h)) - corner_uv.row(h);
    const double length = along.norm();
    if (!(length > 0.0) || !counts(h)) continue;
    const std::complex<double> direction = as_complex(along / length);
    const std::complex<double> twice = direction * direction;
    turn[at(chart_of_face[at(h / 3)])] += length * twice * twice;
  }
  for (std::complex<double>& sum : turn) sum = std::polar(1.0, -0.25 * std::arg(sum));
  for (Eigen::Index c = 0; c < corner_uv.rows(); ++c) {
    const std::complex<double> p =
        turn[at(chart_of_face[at(static_cast<Index>(c) / 3)])] * as_complex(corner_uv.row(c));
    corner_uv.row(c) << p.real(), p.imag();
  }
}

void write_transitions(const std::vector<VertexId>& cones, certify::Parametrization& map) {
  const std::vector<SeamBranch> branches = seam_branches(map, cones);
  std::size_t count = 0;
  for (const SeamBranch& branch : branches) count += branch.halfedges.size();
  map.cut_edges =
      IndexPairs(static_cast<Eigen::Index>(count), 2);  // a resize that fails frees twice
  map.transitions.clear();
  map.transitions.reserve(count);
  for (const SeamBranch& branch : branches) {
    for (const HalfedgeId h : branch.halfedges) {
      map.cut_edges.row(static_cast<Eigen::Index>(map.transitions.size()))
          << mesh::source(map.surface.faces, h),
          mesh::target(map.surface.faces, h);
      map.transitions.push_back(branch.transition);
    }
  }
}

}  // namespace flipfree::seamless
