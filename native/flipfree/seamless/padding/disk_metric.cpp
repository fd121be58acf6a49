#include "flipfree/seamless/padding/disk_metric.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/seamless/padding/segments.h"
#include "flipfree/seamless/penner/penner_newton.h"

namespace flipfree::seamless {

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
    HalfTriangulation half;
    half.mesh = coordinates_.current();
    mark_inside(half);
    half.length = length_;
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
    return corner_[at(coordinates_.star(v)[coordinates_.roundabout(h)])];
  }

  void mark_inside(HalfTriangulation& half) {
    const FlipMesh& mesh = half.mesh;
    half.inside.assign(mesh.halfedge_count(), 0);
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
      if (half.inside[at(h)]) continue;
      for (const HalfedgeId g : {h, mesh.next_of(h), mesh.previous(h)}) {
        half.inside[at(g)] = 1;
        if (!boundary_[at(g >> 1)]) line.push_back(g ^ 1);
      }
    }
    std::size_t count = 0;
    for (const char in : half.inside) count += in != 0;
    if (count != metric_.input_halfedge.size())
      throw InternalError("half triangulation: " + std::to_string(count / 3) + " faces inside");
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
      if (half.inside[at(2 * e)] && half.inside[at(2 * e + 1)]) line.push_back(e);
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
      if (!half.inside[at(h)]) continue;
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
  std::vector<char> boundary_;      // per edge
};

constexpr int kShortestSteps = 60;
// Between angles on the way.
constexpr Nearing kOnTheWay{kNearlyMet, 8, 10.0};
// Newton steps to angles between, and which share of the way they are tried at.
constexpr int kConformalSteps = 40;
constexpr double kFirstAngleShare = 0.25;
constexpr double kLeastAngleShare = 1.0 / 256.0;
// Metrics of one disk with prescribed angles, from its own one on.
class DiskSolver {
 public:
  DiskSolver(const PennerTargets& targets, ConformalMetric own, ExecutionContext& context)
      : targets_(targets),
        context_(context),
        own_(std::move(own)),
        start_(own_, targets, {own_.mesh, {}}, context),
        alike_(targets.vertex_angle.size(), 1.0) {}

  bool started() const { return start_.started(); }

  // By the shortest steps.
  std::optional<ConformalMetric> at_once() {
    CarriedMetric metric = start_.copy();
    PennerRun run = meet(metric, targets_, Meeting::kShortest, kShortestSteps);
    if (run.end != PennerEnd::kConverged) return {};
    return finished(std::move(metric));
  }

  // By way of angles between the disk's own and the targets, each met by conformal changes and the
  // metric brought nearer before the next: so its scale never spans more than doubles hold.
  std::optional<ConformalMetric> stepwise() {
    CarriedMetric now = start_.copy();
    const std::vector<double> missing = now.angles(targets_, context_).vertices.value;
    double reached = 0.0, share = kFirstAngleShare;
    while (reached < 1.0) {
      const double to = std::min(1.0, reached + share);
      PennerTargets part = targets_;
      for (std::size_t v = 0; v < part.vertex_angle.size(); ++v)
        part.vertex_angle[v] -= (1.0 - to) * missing[v];
      CarriedMetric trial = now.copy();
      const PennerRun run = meet(trial, part, Meeting::kConformal, kConformalSteps);
      if (run.end != PennerEnd::kConverged) {
        share *= 0.5;
        if (share < kLeastAngleShare) return {};
        continue;
      }
      come_near(trial, part, Meeting::kShortest, kOnTheWay, alike_, context_);
      now = std::move(trial);
      reached = to;
      share = std::min(2.0 * share, kFirstAngleShare);
    }
    return finished(std::move(now));
  }

 private:
  PennerRun meet(CarriedMetric& metric, const PennerTargets& targets, Meeting how, int most) {
    PennerNewtonOptions newton;
    newton.tolerance = kNearlyMet;
    newton.max_iterations = most;
    return metric.meet(targets, how, newton, context_);
  }

  // All angles from where they are nearly met.
  std::optional<ConformalMetric> finished(CarriedMetric metric) {
    const PennerRun run = metric.meet(targets_, Meeting::kConformal, {}, context_);
    if (run.end != PennerEnd::kConverged) return {};
    ConformalMetric out = own_;
    metric.append_to(out, context_);
    out.angle_error = run.error;
    return out;
  }

  const PennerTargets& targets_;
  ExecutionContext& context_;
  const ConformalMetric own_;
  const CarriedMetric start_;
  const std::vector<double> alike_;
};

// The disk's own metric; nothing where doubles lead to no Delaunay triangulation.
std::optional<ConformalMetric> own_metric(const mesh::Surface& disk,
                                          const std::vector<double>& angle,
                                          ExecutionContext& context) {
  conformal::EngineInput input;
  input.vertex_count = static_cast<Index>(disk.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, disk.faces);
  input.positions = &disk.vertices;
  input.target = angle;
  const auto engine = make_engine(input, 53, context);
  if (!engine->started()) return {};
  ConformalMetric metric;
  engine->finish(metric, false, context);
  return metric;
}

// `angle`: per vertex, total.
ConformalMetric compute_disk_metric(const mesh::Surface& disk, const std::vector<double>& angle,
                                    ExecutionContext& context) {
  const PennerTargets targets{angle, {}};
  if (auto own = own_metric(disk, angle, context)) {
    DiskSolver solver(targets, std::move(*own), context);
    std::optional<ConformalMetric> metric;
    if (solver.started()) metric = solver.at_once();
    if (solver.started() && !metric) metric = solver.stepwise();
    if (metric) return std::move(*metric);
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
