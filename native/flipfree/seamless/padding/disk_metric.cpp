#include "flipfree/seamless/padding/disk_metric.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/numeric/cholesky/laplacian_factor.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

std::vector<HalfedgeId> side_halfedges(const AdmissibleCut& cut, Index side) {
  std::vector<HalfedgeId> halfedges = cut.branches[at(side / 2)];
  if (side % 2 == 0) return halfedges;
  std::reverse(halfedges.begin(), halfedges.end());
  for (HalfedgeId& h : halfedges) h = cut.surface.adjacency().opposite[at(h)];
  return halfedges;
}

namespace {

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
  for (HalfedgeId h = 0; at(h) < weight.size(); ++h) {
    const HalfedgeId beyond = next_corner(h);  // the edge opposite of the corner
    const HalfedgeId back = adjacency.opposite[at(beyond)];
    const auto [a, b] = mesh::sides_at(surface, h);
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

CutSegments cut_segments(const AdmissibleCut& cut) {
  const mesh::Adjacency& adjacency = cut.surface.adjacency();
  std::vector<Index> side_at(adjacency.opposite.size(), kInvalid);  // per half-edge
  std::vector<std::vector<HalfedgeId>> halfedges(2 * cut.branches.size());
  std::vector<char> flat(halfedges.size(), 0);  // is there a flat sector before the side
  for (std::size_t s = 0; s < halfedges.size(); ++s) {
    halfedges[s] = side_halfedges(cut, static_cast<Index>(s));
    for (const HalfedgeId h : halfedges[s]) side_at[at(h)] = static_cast<Index>(s);
    flat[s] =
        std::count(cut.flat_sectors.begin(), cut.flat_sectors.end(), halfedges[s].front()) > 0;
  }
  const mesh::Components components = mesh::components_between(adjacency, branch_edges(cut));
  std::vector<Index> start(at(components.count), kInvalid);
  for (std::size_t s = halfedges.size(); s-- > 0;) {
    if (flat[s] == 0)
      start[at(components.of_face[at(halfedges[s].front() / 3)])] = static_cast<Index>(s);
  }
  CutSegments result;
  result.of_side.assign(halfedges.size(), kInvalid);
  for (const Index first : start) {
    if (first == kInvalid) throw InternalError("a component of the cut has no corner");
    const auto begin = static_cast<Index>(result.segments.size());
    Index end = begin;
    Index s = first;
    do {
      if (flat[at(s)] == 0) {
        result.segments.push_back({end - 1, end + 1, {}});
        ++end;
      }
      result.segments.back().sides.push_back(s);
      result.of_side[at(s)] = end - 1;
      HalfedgeId h = next_corner(halfedges[at(s)].back());
      while (side_at[at(h)] == kInvalid) h = next_corner(adjacency.opposite[at(h)]);
      s = side_at[at(h)];
    } while (s != first);
    result.segments[at(begin)].previous = end - 1;
    result.segments.back().next = begin;
  }
  return result;
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

void throw_unpadded(const std::string& what) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      what + ". Spread the cones further apart, or use the engine \"penner\".");
}

namespace {

using conformal::ConformalMetric;
using intrinsic::EdgeLabel;
using intrinsic::FaceLabel;
using intrinsic::FlipMesh;
using intrinsic::FlippedMetric;
using intrinsic::IntrinsicMesh;
using intrinsic::OverlayCoordinates;

std::vector<Wide> wide(const intrinsic::Scalars& values) {
  return std::visit(
      [](const auto& all) {
        std::vector<Wide> out;
        out.reserve(all.size());
        for (const auto& value : all) {
          if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) {
            out.push_back(Wide(value, kWideBits));
          } else {
            out.push_back(
                Wide::rounded(value, std::max(kWideBits, std::min(value.bits(), Wide::kMaxBits))));
          }
        }
        return out;
      },
      values);
}

class Halver {
 public:
  Halver(const FlippedMetric& metric, const mesh::Adjacency& adjacency,
         const ExecutionContext& context)
      : metric_(metric),
        adjacency_(adjacency),
        context_(context),
        coordinates_(metric.initial),
        length_(wide(metric.length)),
        corner_(metric.initial.halfedge_count(), kInvalid) {
    for (std::size_t c = 0; c < metric.input_halfedge.size(); ++c)
      corner_[at(metric.input_halfedge[c])] = static_cast<HalfedgeId>(c);
  }

  HalfTriangulation run() {
    intrinsic::replay_flips(metric_.flips, 0, metric_.flips.size(), context_,
                            [&](EdgeId e) { coordinates_.flip(FlipMesh::halfedge(e)); });
    for (const HalfedgeId h : row_starts()) cut_row(h);
    mark_inside();
    HalfTriangulation half{coordinates_.current(), length_, {}, {}};
    go_home(half);
    return half;
  }

 private:
  // Of an edge of the final triangulation.
  bool crosses_line(EdgeId e) const {
    const EdgeLabel label = metric_.mesh.edge_label[at(e)];
    return label == EdgeLabel::kPerpendicular || label == EdgeLabel::kDiagonal;
  }

  // Perpendicular half-edges opposite to the vertex at which a row begins, seen along the boundary
  // with the disk on the left.
  std::vector<HalfedgeId> row_starts() const {
    const IntrinsicMesh& mesh = metric_.mesh;
    std::vector<HalfedgeId> starts;
    for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
      if (mesh.edge_label[e] != EdgeLabel::kPerpendicular) continue;
      for (const HalfedgeId h :
           {static_cast<HalfedgeId>(2 * e), static_cast<HalfedgeId>(2 * e + 1)}) {
        if (mesh.face_label[at(mesh.face[at(h)])] == FaceLabel::kTriangle && !mesh.leaves_one(h))
          starts.push_back(h);
      }
    }
    return starts;
  }

  struct RowCorner {
    WideVector place;        // the boundary edge along the x-axis, from the origin
    EdgeId edge = kInvalid;  // from the first corner to this one, after the fan
  };

  // `h`: from the mirror image of the row's second corner to that corner, before its first.
  void cut_row(HalfedgeId h) {
    const FlipMesh& mesh = coordinates_.current();
    const Wide half(0.5);
    std::vector<RowCorner> row(1);
    const auto add_corner = [&](const Wide& leg, const Wide& height, EdgeId edge) {
      const WideVector& last = row.back().place;
      const Wide rise = height - last.y;
      const Wide square = (leg - rise) * (leg + rise);
      if (square.sign() <= 0) throw_unpadded(kImprecise);
      row.push_back({{last.x + sqrt(square), height}, edge});
    };
    // The leg that leads to the left end of h, known before its height is.
    Wide leg = length_[at(mesh.next_of(h) >> 1)];
    EdgeId edge = kInvalid;
    for (;;) {
      if (metric_.mesh.edge_label[at(h >> 1)] == EdgeLabel::kPerpendicular)
        add_corner(leg, half * length_[at(h >> 1)], edge);
      const HalfedgeId op = mesh.previous(h ^ 1);
      const bool left_ends = !crosses_line(op >> 1);  // a corner of the polygon is next
      const bool right_ends = !crosses_line(mesh.next_of(h ^ 1) >> 1);
      const Wide next_leg = length_[at(op >> 1)];
      coordinates_.flip(h);
      if (left_ends && right_ends) {
        add_corner(next_leg, Wide(0.0), h >> 1);
        break;
      }
      if (left_ends) {
        leg = next_leg;
        edge = h >> 1;
        h = mesh.previous(h);
      } else {
        h = mesh.next_of(h ^ 1);
      }
    }
    cut_corners(row);
  }

  // From the fan around the row's first corner to positive triangles.
  void cut_corners(const std::vector<RowCorner>& row) {
    std::vector<std::size_t> stack{0, 1};
    for (std::size_t k = 2; k < row.size(); ++k) {
      while (stack.size() > 1) {
        const std::size_t b = stack.back(), a = stack[stack.size() - 2];
        const WideVector side = row[k].place - row[a].place;
        if (cross(row[b].place - row[a].place, row[k].place - row[b].place).sign() >= 0) break;
        if (a == 0) {
          length_[at(row[k].edge)] = norm(side);
        } else {
          coordinates_.flip(2 * row[b].edge);
          length_[at(row[b].edge)] = norm(side);
        }
        stack.pop_back();
      }
      stack.push_back(k);
    }
    if (stack.size() != 2) throw_unpadded(kImprecise);
  }

  // The disk's own corner, or kInvalid for the other copy, of a half-edge that both triangulations
  // share.
  HalfedgeId own_corner(HalfedgeId h) const {
    const VertexId v = coordinates_.current().origin_of(h);
    return corner_[at(coordinates_.star(v)[at(coordinates_.roundabout(h))])];
  }

  void mark_inside() {
    const FlipMesh& mesh = coordinates_.current();
    inside_.assign(mesh.halfedge_count(), 0);
    boundary_.assign(mesh.edge_count(), 0);
    std::vector<HalfedgeId> line;
    for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
      if (!coordinates_.shared(h)) continue;
      const HalfedgeId c = own_corner(h);
      if (c == kInvalid || adjacency_.opposite[at(c)] != kInvalid) continue;
      boundary_[at(h >> 1)] = 1;
      line.push_back(h);
    }
    while (!line.empty()) {
      const HalfedgeId h = line.back();
      line.pop_back();
      if (inside_[at(h)]) continue;
      for (const HalfedgeId g : {h, mesh.next_of(h), mesh.previous(h)}) {
        inside_[at(g)] = 1;
        if (!boundary_[at(g >> 1)]) line.push_back(g ^ 1);
      }
    }
  }

  // Crossings of e now, and after it were flipped; -1 if it is an edge of the disk's own.
  std::int64_t now(EdgeId e) const {
    return coordinates_.shared(2 * e) ? -1 : coordinates_.crossings(2 * e);
  }
  std::int64_t flipped(EdgeId e) const {
    const FlipMesh& mesh = coordinates_.current();
    const HalfedgeId h = 2 * e, o = h + 1;
    const auto count = [&](HalfedgeId g) { return coordinates_.crossings(g); };
    const intrinsic::FlippedCrossings after = intrinsic::after_flip(
        {count(h), count(mesh.next_of(h)), count(mesh.previous(h)), count(mesh.next_of(o)),
         count(mesh.previous(o)), coordinates_.shared(h)});
    return after.along ? -1 : after.count;
  }

  void flip_home(EdgeId e, HalfTriangulation& half) {
    coordinates_.flip(2 * e);
    half.flips_home.push_back(e);
  }

  // Every flip leaves fewer crossings; where none does, one that shortens the way of a curve
  // (Mosher 1988).
  void go_home(HalfTriangulation& half) {
    const FlipMesh& mesh = coordinates_.current();
    std::vector<EdgeId> line;
    for (EdgeId e = 0; at(e) < mesh.edge_count(); ++e) {
      if (inside_[at(2 * e)] && inside_[at(2 * e + 1)]) line.push_back(e);
    }
    const std::vector<EdgeId> all = line;
    const std::size_t most = 1000 * mesh.edge_count() + 1000;
    for (;;) {
      while (!line.empty()) {
        const EdgeId e = line.back();
        line.pop_back();
        if (now(e) <= 0 || intrinsic::is_glued_to_itself(mesh, e) || flipped(e) >= now(e)) continue;
        flip_home(e, half);
        if (half.flips_home.size() % 1024 == 0) context_.check();
        for (const HalfedgeId h : {2 * e, 2 * e + 1}) {
          for (const HalfedgeId g : {mesh.next_of(h), mesh.previous(h)}) {
            if (!boundary_[at(g >> 1)]) line.push_back(g >> 1);
          }
        }
      }
      bool done = true;
      for (const EdgeId e : all) {
        if (now(e) < 0) continue;
        done = false;
        if (!shortens(e)) continue;
        flip_home(e, half);
        line = all;
        break;
      }
      if (done) break;
      if (line.empty() || half.flips_home.size() > most)
        throw InternalError("half triangulation: no way home");
    }
    half.home.assign(mesh.halfedge_count(), kInvalid);
    for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
      if (!inside_[at(h)]) continue;
      half.home[at(h)] = own_corner(h);
      if (half.home[at(h)] == kInvalid)
        throw InternalError("half triangulation: an edge of the other copy inside");
    }
  }

  // Does a curve begin in a corner opposite to e?
  bool shortens(EdgeId e) const {
    const FlipMesh& mesh = coordinates_.current();
    if (intrinsic::is_glued_to_itself(mesh, e)) return false;
    return coordinates_.corner(mesh.previous(2 * e)).emanating > 0 ||
           coordinates_.corner(mesh.previous(2 * e + 1)).emanating > 0;
  }

  const FlippedMetric& metric_;
  const mesh::Adjacency& adjacency_;
  const ExecutionContext& context_;
  OverlayCoordinates coordinates_;
  std::vector<Wide> length_;
  std::vector<HalfedgeId> corner_;  // of the double cover's own half-edges
  std::vector<char> inside_;        // per half-edge: its face belongs to the disk
  std::vector<char> boundary_;      // per edge
};

// By way of angles between the disk's own and the targets, each met by conformal changes and the
// metric brought nearer before the next: so its scale never spans more than doubles hold. False,
// and the metric is anywhere, if it does not reach them.
bool go_stepwise(const PennerTargets& targets, CarriedMetric& metric, ExecutionContext& context) {
  constexpr double kFirstShare = 0.25, kLeastShare = 1.0 / 256.0;  // of the way, tried at once
  constexpr Nearing kOnTheWay{kNearlyMet, 8, 10.0};
  constexpr int kNewtonSteps = 40;
  const std::vector<double> missing = measure(metric, targets, context).vertices.value;
  const std::vector<double> alike(missing.size(), 1.0);
  double reached = 0.0, share = kFirstShare;
  while (reached < 1.0) {
    const double to = std::min(1.0, reached + share);
    PennerTargets part = targets;
    for (std::size_t v = 0; v < missing.size(); ++v)
      part.vertex_angle[v] -= (1.0 - to) * missing[v];
    CarriedMetric trial = metric;
    if (trial.meet(part, Meeting::kConformal, {kNearlyMet, kNewtonSteps}, context).end !=
        PennerEnd::kConverged) {
      share *= 0.5;
      if (share < kLeastShare) return false;
      continue;
    }
    trial.come_near(part, Meeting::kShortest, kOnTheWay, alike, context);
    metric = std::move(trial);
    reached = to;
    share = std::min(2.0 * share, kFirstShare);
  }
  return true;
}

// From the disk's own metric at once or, where that does not reach the targets, in steps. `angle`:
// per vertex, total.
ConformalMetric compute_disk_metric(const mesh::Surface& disk, const std::vector<double>& angle,
                                    ExecutionContext& context) {
  constexpr int kNewtonSteps = 60;
  const PennerTargets targets{angle, {}};
  conformal::EngineInput input = conformal::input_of(disk);
  input.target = angle;
  const auto engine = make_engine(input, 53, context);
  for (const bool at_once : {true, false}) {
    if (!engine->started()) break;
    ConformalMetric own;
    engine->finish(own, false, context);
    CarriedMetric metric(own, targets, {own.mesh, {}}, context);
    if (!metric.started()) break;
    const bool nearly_met =
        at_once
            ? metric.meet(targets, Meeting::kShortest, {kNearlyMet, kNewtonSteps}, context).end ==
                  PennerEnd::kConverged
            : go_stepwise(targets, metric, context);
    if (!nearly_met) continue;
    // All angles from where they are nearly met.
    const PennerRun run = metric.meet(targets, Meeting::kConformal, {}, context);
    if (run.end != PennerEnd::kConverged) continue;
    metric.append_to(own, context);
    own.angle_error = run.error;
    return own;
  }
  throw_not_converged(ErrorCode::kLineSearchStalled,
                      "The metric of a piece of the surface was not reached. Merge vertices that "
                      "nearly coincide (Merge by Distance), spread the cones further apart, or "
                      "use the engine \"penner\".");
}

}  // namespace

std::vector<CutDisk> solve_disks(const AdmissibleCut& cut, const CutSegments& segments,
                                 const std::vector<Index>& cones, ExecutionContext& context) {
  std::vector<CutPiece> pieces = cut_pieces(cut, segments, cones);
  std::vector<CutDisk> disks(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    auto& [chart, angle] = pieces[i];
    const ProgressRange range(context, i, pieces.size());
    const conformal::ConformalMetric metric = compute_disk_metric(chart.surface, angle, context);
    disks[i].half = Halver(metric, chart.surface.adjacency(), context).run();
    disks[i].chart = std::move(chart);
  }
  return disks;
}

}  // namespace flipfree::seamless
