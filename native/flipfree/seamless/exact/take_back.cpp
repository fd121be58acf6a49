#include "flipfree/seamless/exact/take_back.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/conformal/map.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/intrinsic/layout/layout.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/seamless/exact/parts.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {

namespace {

constexpr int kTakeBackRounds = 6;
// A round that lowers the energy by a smaller share is the last.
constexpr double kWorthwhileRound = 0.05;
// The user's own triangulation is taken if it flips fewer faces than this share.
constexpr double kFewFlips = 0.02;

// Total angles at the first `count` vertices, those of the input.
std::vector<double> vertex_angles(Eigen::Index count, const certify::Parametrization& map) {
  std::vector<double> angle(at(map.surface.vertices.rows()), 0.0);
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c)
    angle[at(mesh::source(map.surface.faces, c))] += certify::corner_angle(map.uv, c);
  angle.resize(at(count));
  return angle;
}

// p -> p turned by quarters + translation.
using Motion = certify::Transition;

Vector2 moved(const Vector2& p, const Motion& by) {
  return turned(p, by.quarter_turns) + by.translation;
}
Motion composed(const Motion& second, const Motion& first) {
  return {(second.quarter_turns + first.quarter_turns) % 4, moved(first.translation, second)};
}
Motion inverse(const Motion& m) {
  const Index back = (4 - m.quarter_turns) % 4;
  return {back, -turned(m.translation, back)};
}

// What each face is moved by to lie in the frame of the first of those that it is joined with,
// over the half-edges h where joined(h, its opposite); link(h, its opposite): from the frame on
// the other side to the one on its own.
template <class Joined, class Link>
std::vector<Motion> laid_out(const mesh::Adjacency& adjacency, Joined joined, Link link) {
  std::vector<Motion> motion(adjacency.opposite.size() / 3);
  mesh::for_each_face_across(adjacency, joined, [&](HalfedgeId h, HalfedgeId o) {
    motion[at(o / 3)] = composed(motion[at(h / 3)], link(h, o));
  });
  return motion;
}

// `map`: of `input`, seamless up to rounding, with cut_edges and provenance.
// `cones`: vertices of the input that the new cut must reach. `avoided`: see mesh::cut_to_disks().
// Result: the input's own triangles, corners where `map` has them but for one motion per component,
// seams that match up to rounding; faces that the map bends may be flipped. No certificate. Cost:
// O(#F log #F).
certify::Parametrization on_own_triangles(const mesh::Surface& input,
                                          const std::vector<VertexId>& cones,
                                          const mesh::EdgeFlags& avoided,
                                          const certify::Parametrization& map,
                                          const ExecutionContext& context) {
  const mesh::Adjacency& adjacency = input.adjacency();
  const mesh::Adjacency& refined = map.surface.adjacency();
  const auto one_parent = [&](HalfedgeId h, HalfedgeId o) {
    return map.parent_face[at(h / 3)] == map.parent_face[at(o / 3)];
  };
  const auto from_beyond = [&](HalfedgeId h, HalfedgeId o) { return across(map.uv, o, h); };
  const std::vector<Motion> to_parent = laid_out(refined, one_parent, from_beyond);
  certify::Parametrization own;
  own.surface = input;
  own.uv.resize(3 * input.faces.rows(), 2);
  std::vector<Motion> link(at(3 * input.faces.rows()));
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c) {
    const VertexId v = map.surface.faces(c / 3, c % 3);
    if (v >= static_cast<VertexId>(input.vertices.rows())) continue;
    const FaceId parent = map.parent_face[at(c / 3)];
    int k = 0;
    while (input.faces(parent, k) != v) ++k;
    own.uv.row(3 * parent + k) = moved(map.uv.row(c).transpose(), to_parent[at(c / 3)]).transpose();
    // Of the half-edges from v with the parent on their left, the one with another on its right
    // runs along the parent's own.
    const HalfedgeId o = refined.opposite[at(c)];
    if (o == kInvalid || map.parent_face[at(o / 3)] == parent) continue;
    link[at(3 * parent + k)] =
        composed(composed(to_parent[at(c / 3)], from_beyond(c, o)), inverse(to_parent[at(o / 3)]));
  }
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const mesh::EdgeFlags cuts = mesh::cut_to_disks(input, adjacency, none, cones, avoided, context);
  const auto uncut = [&](HalfedgeId h, HalfedgeId) { return cuts[at(h)] == 0; };
  const std::vector<Motion> motion =
      laid_out(adjacency, uncut, [&](HalfedgeId h, HalfedgeId) { return link[at(h)]; });
  for (CornerId c = 0; c < static_cast<CornerId>(own.uv.rows()); ++c)
    own.uv.row(c) = moved(own.uv.row(c).transpose(), motion[at(c / 3)]).transpose();
  own.cut_edges = mesh::flagged_edges(input.faces, adjacency, cuts);
  certify::set_identity_provenance(own);
  return own;
}

class TakingBack {
 public:
  TakingBack(const mesh::Surface& input, const std::vector<char>& aligned, int max_iterations,
             ExecutionContext& context)
      : input_(input),
        adjacency_(input.adjacency()),
        aligned_(aligned),
        max_iterations_(max_iterations),
        context_(context) {}

  // The map is whole after every round. Returns their number.
  int run(const IndexPairs& uncuttable, certify::Parametrization& map) {
    angles_ = vertex_angles(input_.vertices.rows(), map);
    std::vector<VertexId> cones;
    for (std::size_t v = 0; v < angles_.size(); ++v) {
      if (std::lround(angles_[v] / kQuarterTurn) != 4) cones.push_back(static_cast<VertexId>(v));
    }
    const mesh::EdgeFlags avoided = uncuttable.rows() == 0
                                        ? mesh::EdgeFlags{}
                                        : mesh::flag_edges(input_.faces, adjacency_, uncuttable);
    double before = std::numeric_limits<double>::infinity();
    for (int round = 1; round <= kTakeBackRounds; ++round) {
      const ProgressRange range(context_, (round - 1) / double{kTakeBackRounds},
                                round / double{kTakeBackRounds});
      if (take(on_own_triangles(input_, cones, avoided, map, context_), map)) return round;
      const std::optional<double> energy = improve(map);
      if (!energy || *energy > (1.0 - kWorthwhileRound) * before || round == kTakeBackRounds) {
        thin_out(map);
        return round;
      }
      before = *energy;
    }
    return 0;
  }

 private:
  // Its energy; none, and nothing done, if the map is too squeezed for it.
  std::optional<double> improve(certify::Parametrization& map) {
    try {
      const distortion::CutMap cut = cut_of(map, aligned_);
      const distortion::Minimized better =
          distortion::less_distorted(cut, max_iterations_, context_);
      map.uv = distortion::corners_of(cut, better.uv);
      return better.energy;
    } catch (const NotConverged& failure) {
      if (failure.error().code == ErrorCode::kTimeLimit) throw;
      return std::nullopt;
    }
  }

  // Where the boundary is aligned, an edge that lies the other way round changes the angles at its
  // ends by half a turn.
  bool winds_as_before(const certify::Parametrization& map) const {
    const std::vector<double> angles = vertex_angles(input_.vertices.rows(), map);
    for (std::size_t v = 0; v < angles.size(); ++v) {
      const bool aligned = aligned_[at(adjacency_.vertex_halfedge[v] / 3)] != 0;
      const double most = aligned ? 0.25 * std::numbers::pi : std::numbers::pi;
      if (!(std::abs(angles[v] - angles_[v]) < most)) return false;
    }
    return true;
  }

  // The map on the input's own triangles, if it flips nowhere, or so little that it can be opened,
  // and winds as it did.
  bool take(certify::Parametrization own, certify::Parametrization& map) {
    const distortion::CutMap cut = cut_of(own, aligned_);
    const auto most = static_cast<std::size_t>(kFewFlips * static_cast<double>(own.uv.rows() / 3));
    const auto uv = distortion::opened_on_grid(cut, most, context_);
    if (!uv) return false;
    own.uv = distortion::corners_of(cut, *uv);
    return replace(map, std::move(own));
  }

  // On as few triangles as the map's values allow, cut where it is.
  void thin_out(certify::Parametrization& map) {
    const auto points = edge_point_map(input_, map);
    if (!points) return;
    intrinsic::RefinedLayout layout = intrinsic::refine_map(
        input_, *points, intrinsic::Refinement::kAuto, intrinsic::Storage::k64And32, context_);
    if (!layout.invalid.empty()) return;
    mesh::EdgeFlags cut(points->edge_of.size(), 0);  // of half-edges that stand for their edge
    std::set<std::pair<VertexId, VertexId>> whole;
    for (Eigen::Index e = 0; e < map.cut_edges.rows(); ++e) {
      const auto [a, v] = std::minmax(map.cut_edges(e, 0), map.cut_edges(e, 1));
      whole.emplace(a, v);
      for (int k = 0; v >= input_.vertices.rows() && k < 3; ++k) {
        if (map.vertex_barycentric(v, k) == 0.0)
          cut[at(points->edge_halfedge[at(
              points->edge_of[at(3 * map.vertex_parent[at(v)] + (k + 1) % 3)])])] = 1;
      }
    }
    for (const HalfedgeId h : points->edge_halfedge) {
      if (whole.contains(std::minmax(mesh::source(input_.faces, h), mesh::target(input_.faces, h))))
        cut[at(h)] = 1;
    }
    certify::Parametrization fewer;
    fewer.cut_edges = intrinsic::edges_on(input_.faces, *points, cut, layout);
    conformal::take_map(layout, fewer);
    if (fewer.surface.vertices.rows() < map.surface.vertices.rows()) replace(map, std::move(fewer));
  }

  // By one that winds as it did; false, and nothing done, if it does not.
  bool replace(certify::Parametrization& map, certify::Parametrization by) const {
    if (!winds_as_before(by)) return false;
    by.stats = std::move(map.stats);
    by.certificate = std::move(map.certificate);
    map = std::move(by);
    return true;
  }

  const mesh::Surface& input_;
  const mesh::Adjacency& adjacency_;
  const std::vector<char>& aligned_;  // per face
  int max_iterations_;
  ExecutionContext& context_;
  std::vector<double> angles_;  // at the input's vertices
};

}  // namespace

std::optional<intrinsic::EdgePointMap> edge_point_map(const mesh::Surface& input,
                                                      const certify::Parametrization& map) {
  const auto own = static_cast<Index>(input.vertices.rows());
  const mesh::Adjacency& adjacency = input.adjacency();
  const intrinsic::InputEdges edges = intrinsic::number_edges(adjacency);
  // Where the added vertices lie: on which edge, and where along its half-edge.
  struct Place {
    Index edge = kInvalid;
    intrinsic::Between along;
  };
  std::vector<Place> places;
  for (Index v = own; v < static_cast<Index>(map.surface.vertices.rows()); ++v) {
    Place& place = places.emplace_back();
    for (int k = 0; k < 3; ++k) {
      if (map.vertex_barycentric(v, k) != 0.0) continue;
      const HalfedgeId h = 3 * map.vertex_parent[at(v)] + (k + 1) % 3;
      const double source = map.vertex_barycentric(v, (k + 1) % 3);
      const double target = map.vertex_barycentric(v, (k + 2) % 3);
      place.edge = edges.of_corner[at(h)];
      const bool along = edges.halfedge[at(place.edge)] == h;
      place.along = along ? intrinsic::Between{source, target} : intrinsic::Between{target, source};
    }
    if (place.edge == kInvalid) return std::nullopt;
  }
  intrinsic::EdgePointMap out;
  out.corner_uv = Points2::Zero(3 * input.faces.rows(), 2);
  out.corner_angle.assign(at(3 * input.faces.rows()), 0.0);
  out.edge_halfedge = edges.halfedge;
  out.edge_of = edges.of_corner;
  out.begin.assign(edges.halfedge.size() + 1, 0);
  for (const Place& place : places) ++out.begin[at(place.edge) + 1];
  std::partial_sum(out.begin.begin(), out.begin.end(), out.begin.begin());
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Place &p = places[a], &q = places[b];
    return p.edge != q.edge ? p.edge < q.edge : p.along.target < q.along.target;
  });
  std::vector<std::size_t> point_of(places.size());
  out.points.resize(places.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    point_of[order[i]] = i;
    out.points[i].along = places[order[i]].along;
  }
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c) {
    const FaceId parent = map.parent_face[at(c / 3)];
    const VertexId v = map.surface.faces(c / 3, c % 3);
    if (v >= own) {
      intrinsic::EdgePoint& point = out.points[point_of[at(v - own)]];
      const HalfedgeId h = out.edge_halfedge[at(places[at(v - own)].edge)];
      if (h / 3 == parent) point.uv_left = map.uv.row(c);
      if (h / 3 != parent || adjacency.opposite[at(h)] == kInvalid) point.uv_right = map.uv.row(c);
      continue;
    }
    int k = 0;
    while (input.faces(parent, k) != v) ++k;
    const Vector2 p = map.uv.row(c);
    const Vector2 a = map.uv.row(next_corner(c)).transpose() - p;
    const Vector2 b = map.uv.row(previous_corner(c)).transpose() - p;
    out.corner_uv.row(3 * parent + k) = p.transpose();
    out.corner_angle[at(3 * parent + k)] += turn(a, b);
  }
  return out;
}

void take_back(const mesh::Surface& input, const std::vector<char>& aligned,
               const IndexPairs& uncuttable, int max_iterations, certify::Parametrization& map,
               ExecutionContext& context) {
  const auto added = [&] {
    return static_cast<std::int64_t>(map.surface.vertices.rows() - input.vertices.rows());
  };
  const std::int64_t before = added();
  if (before == 0) return;
  context.report("taking refinement back", 0.0);
  std::int64_t rounds = 0;
  TakingBack work(input, aligned, max_iterations, context);
  ended_in_time([&] { rounds = work.run(uncuttable, map); });
  map.stats["taken_back.rounds"] = rounds;
  map.stats["taken_back.vertices"] = before - added();
  map.stats["added_vertices"] = added();
}

}  // namespace flipfree::seamless
