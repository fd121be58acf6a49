#include "flipfree/seamless/exact/take_back.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/conformal/map.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/intrinsic/layout/development.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/seamless/exact/parts.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {

namespace {

constexpr int kTakeBackRounds = 6;
// A round that takes back a smaller share of the added vertices is the last.
constexpr double kWorthwhileRound = 0.05;
// The user's own triangulation is tried if it flips fewer faces than this share.
constexpr double kFewFlips = 0.02;

// The input, and what of it is cut.
struct Input {
  Input(const mesh::Surface& whole, mesh::Adjacency around)
      : surface(whole), adjacency(std::move(around)), edges(intrinsic::number_edges(adjacency)) {}

  const mesh::Surface& surface;
  mesh::Adjacency adjacency;
  intrinsic::InputEdges edges;
  std::vector<char> cut;  // per edge
};

// Where the added vertices of a map lie: on which edge, and where along its half-edge.
struct EdgePlace {
  Index edge = kInvalid;
  intrinsic::Between along;
};

std::optional<std::vector<EdgePlace>> edge_places(const Input& input,
                                                  const certify::Parametrization& map) {
  const auto own = static_cast<Index>(input.surface.vertices.rows());
  std::vector<EdgePlace> places;
  for (Index v = own; v < static_cast<Index>(map.surface.vertices.rows()); ++v) {
    const FaceId f = map.vertex_parent[at(v)];
    EdgePlace place;
    for (int k = 0; k < 3; ++k) {
      if (map.vertex_barycentric(v, k) != 0.0) continue;
      const HalfedgeId h = 3 * f + (k + 1) % 3;
      const double source = map.vertex_barycentric(v, (k + 1) % 3);
      const double target = map.vertex_barycentric(v, (k + 2) % 3);
      place.edge = input.edges.of_corner[at(h)];
      const bool along = input.edges.halfedge[at(place.edge)] == h;
      place.along = along ? intrinsic::Between{source, target} : intrinsic::Between{target, source};
    }
    if (place.edge == kInvalid) return std::nullopt;
    places.push_back(place);
  }
  return places;
}

// Which edges of the input the cut of the map runs along.
void find_cut(const certify::Parametrization& map, const std::vector<EdgePlace>& places,
              Input& input) {
  const auto own = static_cast<Index>(input.surface.vertices.rows());
  input.cut.assign(input.edges.halfedge.size(), 0);
  std::vector<std::array<Index, 2>> whole;
  for (Eigen::Index e = 0; e < map.cut_edges.rows(); ++e) {
    const Index a = map.cut_edges(e, 0), b = map.cut_edges(e, 1);
    if (std::max(a, b) >= own) {
      input.cut[at(places[at(std::max(a, b) - own)].edge)] = 1;
    } else {
      whole.push_back({a, b});
    }
  }
  IndexPairs pairs(static_cast<Eigen::Index>(whole.size()), 2);
  for (std::size_t i = 0; i < whole.size(); ++i)
    pairs.row(static_cast<Eigen::Index>(i)) << whole[i][0], whole[i][1];
  const mesh::EdgeFlags flags = mesh::flag_edges(input.surface.faces, input.adjacency, pairs);
  for (std::size_t e = 0; e < input.cut.size(); ++e) {
    if (flags[at(input.edges.halfedge[e])] != 0) input.cut[e] = 1;
  }
}

// The map as one that is known at the input's corners and at points along its edges.
intrinsic::EdgePointMap edge_point_map(const Input& input, const certify::Parametrization& map,
                                       const std::vector<EdgePlace>& places) {
  const auto own = static_cast<Index>(input.surface.vertices.rows());
  const Triangles& faces = input.surface.faces;
  intrinsic::EdgePointMap out;
  out.corner_uv = Points2::Zero(3 * faces.rows(), 2);
  out.corner_angle.assign(static_cast<std::size_t>(3 * faces.rows()), 0.0);
  out.edge_halfedge = input.edges.halfedge;
  out.edge_of = input.edges.of_corner;
  out.begin.assign(input.edges.halfedge.size() + 1, 0);
  for (const EdgePlace& place : places) ++out.begin[at(place.edge) + 1];
  for (std::size_t e = 1; e < out.begin.size(); ++e) out.begin[e] += out.begin[e - 1];
  std::vector<Index> order(places.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Index>(i);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    const EdgePlace &p = places[at(a)], &q = places[at(b)];
    return p.edge != q.edge ? p.edge < q.edge : p.along.target < q.along.target;
  });
  std::vector<std::int64_t> point_of(places.size());
  out.points.resize(places.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    point_of[at(order[i])] = static_cast<std::int64_t>(i);
    out.points[i].along = places[at(order[i])].along;
  }
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c) {
    const FaceId parent = map.parent_face[at(c / 3)];
    const VertexId v = map.surface.faces(c / 3, c % 3);
    if (v >= own) {
      intrinsic::EdgePoint& point = out.points[at(point_of[at(v - own)])];
      const HalfedgeId h = out.edge_halfedge[at(places[at(v - own)].edge)];
      if (h / 3 == parent) point.uv_left = map.uv.row(c);
      if (h / 3 != parent || input.adjacency.opposite[at(h)] == kInvalid)
        point.uv_right = map.uv.row(c);
      continue;
    }
    int k = 0;
    while (faces(parent, k) != v) ++k;
    const Vector2 p = map.uv.row(c);
    const Vector2 a = map.uv.row(next_corner(c)).transpose() - p;
    const Vector2 b = map.uv.row(previous_corner(c)).transpose() - p;
    out.corner_uv.row(3 * parent + k) = p.transpose();
    out.corner_angle[at(3 * parent + k)] += turn(a, b);
  }
  return out;
}

// The map on the triangulation that was chosen.
certify::Parametrization written(const Input& input, const intrinsic::EdgePointMap& points,
                                 intrinsic::RefinedLayout layout) {
  certify::Parametrization map;
  map.cut_edges = intrinsic::edges_on(input.surface.faces, points, input.cut, layout);
  conformal::take_map(layout, map);
  return map;
}

// Total angles at the input's vertices.
std::vector<double> vertex_angles(const Input& input, const certify::Parametrization& map) {
  std::vector<double> angle(static_cast<std::size_t>(map.surface.vertices.rows()), 0.0);
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c) {
    const Vector2 p = map.uv.row(c);
    angle[at(map.surface.faces(c / 3, c % 3))] += turn(
        map.uv.row(next_corner(c)).transpose() - p, map.uv.row(previous_corner(c)).transpose() - p);
  }
  angle.resize(static_cast<std::size_t>(input.surface.vertices.rows()));
  return angle;
}

// p -> p turned by quarters + shift.
struct Motion {
  Index turns = 0;
  Vector2 shift = Vector2::Zero();

  Vector2 operator()(const Vector2& p) const { return turned(p, turns) + shift; }
  Motion after(const Motion& first) const {
    return {(turns + first.turns) % 4, (*this)(first.shift)};
  }
  Motion inverse() const {
    const Index back = (4 - turns) % 4;
    return {back, -turned(shift, back)};
  }
};

// From the chart on the other side of half-edge h to the chart on its own.
Motion across(const Points2& uv, HalfedgeId h, HalfedgeId o) {
  const Vector2 source = uv.row(h), target = uv.row(next_corner(h));
  const Vector2 other_source = uv.row(next_corner(o)), other_target = uv.row(o);
  const double angle = turn(other_target - other_source, target - source);
  Motion motion;
  motion.turns = static_cast<Index>(std::lround(angle / (0.5 * std::numbers::pi)) & 3);
  motion.shift =
      0.5 * (source + target) - turned(0.5 * (other_source + other_target), motion.turns);
  return motion;
}

// What each face is moved by to lie in the frame of the first of those that it is joined with,
// over the half-edges h where joined(h, its opposite); link(h, its opposite): from the frame on
// the other side to the one on its own.
template <class Joined, class Link>
std::vector<Motion> laid_out(const mesh::Adjacency& adjacency, Joined joined, Link link) {
  std::vector<Motion> motion(adjacency.opposite.size() / 3);
  std::vector<char> known(motion.size(), 0);
  std::vector<FaceId> queue;
  for (FaceId first = 0; at(first) < known.size(); ++first) {
    if (known[at(first)] != 0) continue;
    known[at(first)] = 1;
    queue.assign(1, first);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      for (HalfedgeId h = 3 * queue[i]; h < 3 * queue[i] + 3; ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (!joined(h, o) || known[at(o / 3)] != 0) continue;
        known[at(o / 3)] = 1;
        motion[at(o / 3)] = motion[at(h / 3)].after(link(h, o));
        queue.push_back(o / 3);
      }
    }
  }
  return motion;
}

// `map`: of `input`, a closed surface, seamless up to rounding, with cut_edges and provenance.
// `cones`: vertices of the input that the new cut must reach. `avoided`: see mesh::cut_to_disks().
// Result: the input's own triangles, corners where `map` has them but for one motion per component,
// seams that match up to rounding; faces that the map bends may be flipped. No certificate. Cost:
// O(#F log #F).
certify::Parametrization on_own_triangles(const mesh::Surface& input,
                                          const mesh::Adjacency& adjacency,
                                          const std::vector<VertexId>& cones,
                                          const mesh::EdgeFlags& avoided,
                                          const certify::Parametrization& map,
                                          const ExecutionContext& context) {
  const mesh::Adjacency refined = mesh::build_adjacency(map.surface);
  const auto one_parent = [&](HalfedgeId h, HalfedgeId o) {
    return map.parent_face[at(h / 3)] == map.parent_face[at(o / 3)];
  };
  const std::vector<Motion> to_parent = laid_out(
      refined, one_parent, [&](HalfedgeId h, HalfedgeId o) { return across(map.uv, h, o); });
  certify::Parametrization own;
  own.surface = input;
  own.uv.resize(3 * input.faces.rows(), 2);
  std::vector<Motion> link(static_cast<std::size_t>(3 * input.faces.rows()));
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c) {
    const VertexId v = map.surface.faces(c / 3, c % 3);
    if (v >= static_cast<VertexId>(input.vertices.rows())) continue;
    const FaceId parent = map.parent_face[at(c / 3)];
    int k = 0;
    while (input.faces(parent, k) != v) ++k;
    own.uv.row(3 * parent + k) = to_parent[at(c / 3)](map.uv.row(c).transpose()).transpose();
    // Of the half-edges from v with the parent on their left, the one with another on its right
    // runs along the parent's own.
    const HalfedgeId o = refined.opposite[at(c)];
    if (map.parent_face[at(o / 3)] == parent) continue;
    link[at(3 * parent + k)] =
        to_parent[at(c / 3)].after(across(map.uv, c, o)).after(to_parent[at(o / 3)].inverse());
  }
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const mesh::EdgeFlags cuts = mesh::cut_to_disks(input, adjacency, none, cones, avoided, context);
  const auto uncut = [&](HalfedgeId h, HalfedgeId) { return cuts[at(h)] == 0; };
  const std::vector<Motion> motion =
      laid_out(adjacency, uncut, [&](HalfedgeId h, HalfedgeId) { return link[at(h)]; });
  for (CornerId c = 0; c < static_cast<CornerId>(own.uv.rows()); ++c)
    own.uv.row(c) = motion[at(c / 3)](own.uv.row(c).transpose()).transpose();
  own.cut_edges = mesh::flagged_edges(input.faces, adjacency, cuts);
  certify::set_identity_provenance(own);
  return own;
}

class TakingBack {
 public:
  TakingBack(const mesh::Surface& surface, const std::vector<char>& aligned,
             const IndexPairs& uncuttable, int max_iterations, ExecutionContext& context)
      : input_(surface,
               mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces)),
        aligned_(aligned),
        uncuttable_(uncuttable),
        max_iterations_(max_iterations),
        context_(context) {}

  int run(certify::Parametrization& map) {
    const auto places = edge_places(input_, map);
    if (!places) return recut(map);
    find_cut(map, *places, input_);
    angles_ = vertex_angles(input_, map);
    // Where little is to be done, steps on the refined surface would be for nothing.
    if (take(own_triangles(map), map)) return 1;
    if (!improve(map)) return 0;
    int round = 0;
    for (bool worthwhile = true; worthwhile && round < kTakeBackRounds && added(map) > 0; ++round) {
      const ProgressRange range(context_, round / double{kTakeBackRounds},
                                (round + 1) / double{kTakeBackRounds});
      const Index before = added(map);
      worthwhile =
          take(own_triangles(map), map) ||
          (take(fewer_triangles(map), map) && added(map) <= (1.0 - kWorthwhileRound) * before);
    }
    return round;
  }

  // The optimisation of the whole map; nothing if it has changed since, or was not done.
  const std::optional<distortion::Minimized>& whole() const { return whole_; }

  Index added(const certify::Parametrization& map) const {
    return static_cast<Index>(map.surface.vertices.rows() - input_.surface.vertices.rows());
  }

 private:
  distortion::CutMap cut_of(const certify::Parametrization& map) const {
    const mesh::Adjacency adjacency = mesh::build_adjacency(map.surface);
    const mesh::EdgeFlags cuts = mesh::flag_edges(map.surface.faces, adjacency, map.cut_edges);
    distortion::CutMap cut = distortion::cut_map(map.surface, adjacency, cuts, map.uv);
    cut.straight = straight_where(aligned_, map.parent_face, cut, adjacency);
    return cut;
  }

  // Where added vertices lie inside the input's faces, cuts may run there too: its own triangles
  // are cut anew, or the map stays refined and is improved as it is.
  int recut(certify::Parametrization& map) {
    angles_ = vertex_angles(input_, map);
    const bool closed =
        std::find(input_.adjacency.opposite.begin(), input_.adjacency.opposite.end(), kInvalid) ==
        input_.adjacency.opposite.end();
    if (!closed) return 0;
    std::vector<VertexId> cones;
    for (std::size_t v = 0; v < angles_.size(); ++v) {
      if (std::lround(angles_[v] / (0.5 * std::numbers::pi)) != 4)
        cones.push_back(static_cast<VertexId>(v));
    }
    const mesh::EdgeFlags avoided =
        uncuttable_.rows() == 0
            ? mesh::EdgeFlags{}
            : mesh::flag_edges(input_.surface.faces, input_.adjacency, uncuttable_);
    int round = 0;
    while (round < kTakeBackRounds) {
      const ProgressRange range(context_, round / double{kTakeBackRounds},
                                (round + 1) / double{kTakeBackRounds});
      ++round;
      if (take(opened(on_own_triangles(input_.surface, input_.adjacency, cones, avoided, map,
                                       context_)),
               map))
        break;
      const double before = whole_ ? whole_->energy : 0.0;
      if (!improve_whole(cut_of(map), map)) break;
      if (before > 0.0 && whole_->energy > (1.0 - kWorthwhileRound) * before) break;
    }
    return round;
  }

  // Around what was added and what is bad, where that is little.
  bool improve_near(const distortion::CutMap& cut, certify::Parametrization& map) {
    std::vector<char> near(static_cast<std::size_t>(cut.uv.rows()), 0);
    for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c) {
      if (map.surface.faces(c / 3, c % 3) >= input_.surface.vertices.rows())
        near[at(cut.surface.faces(c / 3, c % 3))] = 1;
    }
    const auto better = distortion::less_distorted_near(cut, near, context_);
    if (!better) return false;
    map.uv = distortion::corners_of(cut, *better);
    whole_.reset();
    return true;
  }

  // False, and nothing done, if the map is too squeezed for it.
  bool improve_whole(const distortion::CutMap& cut, certify::Parametrization& map) {
    try {
      whole_ = distortion::less_distorted(cut, max_iterations_, context_);
      map.uv = distortion::corners_of(cut, whole_->uv);
    } catch (const NotConverged& failure) {
      if (failure.error().code == ErrorCode::kTimeLimit) throw;
      return false;
    }
    return true;
  }

  bool improve(certify::Parametrization& map) {
    const distortion::CutMap cut = cut_of(map);
    return improve_near(cut, map) || improve_whole(cut, map);
  }

  // Where the boundary is aligned, an edge that lies the other way round changes the angles at its
  // ends by half a turn.
  bool winds_as_before(const certify::Parametrization& map) const {
    const std::vector<double> angles = vertex_angles(input_, map);
    for (std::size_t v = 0; v < angles.size(); ++v) {
      const bool aligned = aligned_[at(input_.adjacency.vertex_halfedge[v] / 3)] != 0;
      const double most = aligned ? 0.25 * std::numbers::pi : std::numbers::pi;
      if (!(std::abs(angles[v] - angles_[v]) < most)) return false;
    }
    return true;
  }

  // On as few triangles as the map's values allow.
  std::optional<certify::Parametrization> fewer_triangles(const certify::Parametrization& map) {
    const intrinsic::EdgePointMap points = edge_point_map(input_, map, *edge_places(input_, map));
    intrinsic::RefinedLayout layout =
        intrinsic::refine_map(input_.surface, input_.adjacency, points,
                              intrinsic::Refinement::kAuto, intrinsic::Storage::k64And32, context_);
    if (!layout.invalid.empty()) return std::nullopt;
    return written(input_, points, std::move(layout));
  }

  // On the input's own triangles, if these flip nowhere, or so little that it can be opened.
  std::optional<certify::Parametrization> own_triangles(const certify::Parametrization& map) {
    intrinsic::EdgePointMap points = edge_point_map(input_, map, *edge_places(input_, map));
    points.points.clear();
    std::fill(points.begin.begin(), points.begin.end(), 0);
    certify::Parametrization own =
        written(input_, points,
                intrinsic::refine_map(input_.surface, input_.adjacency, points,
                                      intrinsic::Refinement::kNever, intrinsic::Storage::k64Only,
                                      context_));
    return opened(std::move(own));
  }

  // A map on the input's own triangles, if it flips nowhere, or so little that it can be opened.
  std::optional<certify::Parametrization> opened(certify::Parametrization own) {
    const distortion::CutMap cut = cut_of(own);
    const auto most = static_cast<std::size_t>(kFewFlips * static_cast<double>(own.uv.rows() / 3));
    const auto uv = distortion::opened_on_grid(cut, most, context_);
    if (!uv) return std::nullopt;
    own.uv = distortion::corners_of(cut, *uv);
    return own;
  }

  // The candidate, improved, if it is one with fewer vertices that winds as the map does.
  bool take(std::optional<certify::Parametrization> from, certify::Parametrization& map) {
    if (!from || added(*from) >= added(map) || !winds_as_before(*from) || !improve(*from))
      return false;
    from->stats = std::move(map.stats);
    from->certificate = std::move(map.certificate);
    map = std::move(*from);
    return true;
  }

  Input input_;
  const std::vector<char>& aligned_;  // per face
  const IndexPairs& uncuttable_;
  int max_iterations_;
  ExecutionContext& context_;
  std::vector<double> angles_;                  // at the input's vertices
  std::optional<distortion::Minimized> whole_;  // if it was the last that was done to the map
};

}  // namespace

std::optional<intrinsic::EdgePointMap> edge_point_map(const mesh::Surface& input,
                                                      const mesh::Adjacency& adjacency,
                                                      const certify::Parametrization& map) {
  const Input whole(input, adjacency);
  const auto places = edge_places(whole, map);
  if (!places) return std::nullopt;
  return edge_point_map(whole, map, *places);
}

bool take_back(const mesh::Surface& input, const std::vector<char>& aligned,
               const IndexPairs& uncuttable, int max_iterations, certify::Parametrization& map,
               ExecutionContext& context) {
  TakingBack work(input, aligned, uncuttable, max_iterations, context);
  const Index before = work.added(map);
  if (before == 0) return false;
  context.report("taking refinement back", 0.0);
  std::int64_t rounds = 0;
  ended_in_time([&] { rounds = work.run(map); });  // the map is whole after every step
  map.stats["taken_back.rounds"] = rounds;
  map.stats["taken_back.vertices"] = static_cast<std::int64_t>(before - work.added(map));
  map.stats["added_vertices"] = static_cast<std::int64_t>(work.added(map));
  if (!work.whole()) return false;
  report(*work.whole(), map.stats);
  return work.whole()->stop == distortion::Stop::kConverged;
}

}  // namespace flipfree::seamless
