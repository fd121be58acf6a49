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
#include "flipfree/base/failure.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/conformal/newton.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/seamless/padding/segments.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "flipfree/seamless/penner/relaxation.h"

namespace flipfree::seamless {

namespace {

using intrinsic::EdgeLabel;
using intrinsic::FaceLabel;
using intrinsic::FlipMesh;
using intrinsic::FlippedMetric;
using intrinsic::IntrinsicMesh;
using intrinsic::OverlayCoordinates;

[[noreturn]] void throw_imprecise() {
  throw_not_converged(ErrorCode::kIterationLimit,
                      "The metric of a piece of the surface is not precise enough to be padded. "
                      "Spread the cones further apart, or use the engine \"penner\".");
}

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
      if (square.sign() <= 0) throw_imprecise();
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
    if (stack.size() != 2) throw_imprecise();
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

}  // namespace

HalfTriangulation halve(const FlippedMetric& metric, const mesh::Adjacency& adjacency,
                        const ExecutionContext& context) {
  return Halver(metric, adjacency, context).run();
}

std::vector<CutDisk> solve_disks(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                                 const CutSegments& segments, const std::vector<Index>& cones,
                                 ExecutionContext& context) {
  const OpenCut open = open_cut(cut, adjacency, segments, cones);
  std::vector<mesh::Chart> charts = mesh::split_into_charts(cut.surface.vertices, open.mesh);
  std::vector<CutDisk> disks(charts.size());
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const auto count = static_cast<double>(charts.size());
    const ProgressRange range(context, static_cast<double>(i) / count,
                              static_cast<double>(i + 1) / count);
    std::vector<double> own;
    for (const VertexId v : charts[i].vertices) own.push_back(open.angle[at(v)]);
    const conformal::ConformalMetric metric = compute_disk_metric(charts[i].surface, own, context);
    const mesh::Adjacency of_chart =
        mesh::build_adjacency(static_cast<Index>(own.size()), charts[i].surface.faces);
    disks[i].half = halve(metric, of_chart, context);
    disks[i].chart = std::move(charts[i]);
    disks[i].iterations = metric.iterations;
    disks[i].bits = metric.bits;
    disks[i].scale_range = metric.scale_range;
  }
  return disks;
}

using conformal::ConformalMetric;

namespace {

constexpr double kTolerance = 1e-10;  // radians
constexpr int kShortestSteps = 60;
// Of the conformal metric, where that has to serve.
constexpr int kDiskNearSteps = 8;
constexpr double kDiskNearEnough = 10.0;
// Newton steps to angles between, and which share of the way they are tried at.
constexpr int kConformalSteps = 40;
constexpr double kFirstAngleShare = 0.25;
constexpr double kLeastAngleShare = 1.0 / 256.0;
// Of the conformal metric, in all precisions together. Where vertices nearly coincide every step
// takes seconds in the end, and there is none in sight.
constexpr int kMostIterations = 150;

conformal::EngineInput input_of(const mesh::Surface& disk, const std::vector<double>& angle) {
  conformal::EngineInput input;
  input.setup =
      intrinsic::build_intrinsic_mesh(static_cast<Index>(disk.vertices.rows()), disk.faces);
  input.vertex_count = static_cast<Index>(disk.vertices.rows());
  input.positions = &disk.vertices;
  input.target = angle;
  return input;
}

// All angles from where they are nearly met; false if that fails.
bool finish(std::unique_ptr<conformal::MetricEngine>& engine, const PennerTargets& targets,
            PennerRun& run, ExecutionContext& context) {
  intrinsic::LoopCarrier none(engine->mesh(), {});
  PennerNewtonOptions newton;
  newton.tolerance = kTolerance;
  run = run_penner(engine, none, targets, newton, context);
  return run.end == PennerEnd::kConverged;
}

// By the shortest steps from the disk's own metric.
std::optional<ConformalMetric> shortest(const conformal::EngineInput& input,
                                        const PennerTargets& targets, ExecutionContext& context) {
  auto engine = make_engine(input, 53, context);
  if (!engine->started()) return {};
  intrinsic::LoopCarrier none(engine->mesh(), {});  // which is Delaunay already
  PennerNewtonOptions newton;
  newton.tolerance = kNearlyMet;
  newton.max_iterations = kShortestSteps;
  PennerRun run = run_shortest(engine, none, targets, newton, context);
  const int iterations = run.iterations;
  if (run.end != PennerEnd::kConverged || !finish(engine, targets, run, context)) return {};
  ConformalMetric metric;
  engine->finish(metric, false, context);
  metric.iterations = iterations + run.iterations;
  metric.angle_error = run.error;
  return metric;
}

// What an engine on the triangulation of `metric` starts from. The engine reads it to its end.
conformal::EngineInput further_input(const ConformalMetric& metric,
                                     const std::vector<double>& target) {
  conformal::EngineInput further;
  further.setup = {metric.mesh, metric.input_halfedge, metric.on_boundary};
  further.vertex_count = static_cast<Index>(target.size());
  further.edge_length = intrinsic::to_doubles(metric.length);
  further.target = target;
  return further;
}

// The engine may not have started.
CarriedMetric carried_from(const conformal::EngineInput& further, const ConformalMetric& metric,
                           ExecutionContext& context) {
  CarriedMetric carried{
      make_engine(further, 53, context), {metric.mesh, {}}, ReferenceMetric(metric)};
  if (!carried.engine->started()) return carried;
  intrinsic::replay_flips(carried.engine->flips(), 0, carried.engine->flips().size(), context,
                          [&](EdgeId e) {
                            carried.reference.flip(e);
                            carried.loops.flip(e);
                          });
  return carried;
}

// `metric` with all angles met, once they nearly are; false if that fails.
bool finished(CarriedMetric& carried, const PennerTargets& targets, ConformalMetric& metric,
              ExecutionContext& context) {
  PennerRun run;
  if (!finish(carried.engine, targets, run, context)) return false;
  ConformalMetric near;
  carried.engine->finish(near, false, context);
  metric.flips.insert(metric.flips.end(), near.flips.begin(), near.flips.end());
  metric.mesh = std::move(near.mesh);
  metric.length = std::move(near.length);
  metric.iterations += run.iterations;
  metric.angle_error = run.error;
  return true;
}

// By way of angles between the disk's own and the targets, each met by conformal changes and the
// metric brought nearer before the next: so its scale never spans more than doubles hold.
std::optional<ConformalMetric> stepwise(const conformal::EngineInput& input,
                                        const PennerTargets& targets, ExecutionContext& context) {
  ConformalMetric metric;
  {
    const auto engine = make_engine(input, 53, context);
    if (!engine->started()) return {};
    engine->finish(metric, false, context);
  }
  const conformal::EngineInput further = further_input(metric, targets.vertex_angle);
  CarriedMetric now = carried_from(further, metric, context);
  if (!now.engine->started()) return {};
  PennerAngles own;
  measure(*now.engine, now.loops, targets, own, context);
  PennerNewtonOptions newton;
  newton.tolerance = kNearlyMet;
  newton.max_iterations = kConformalSteps;
  double reached = 0.0, share = kFirstAngleShare;
  while (reached < 1.0) {
    const double to = std::min(1.0, reached + share);
    PennerTargets part = targets;
    for (std::size_t v = 0; v < part.vertex_angle.size(); ++v)
      part.vertex_angle[v] -= (1.0 - to) * own.vertices.value[v];
    CarriedMetric trial = now.copy();
    const std::size_t first = trial.engine->flips().size();
    const PennerRun run = run_penner(trial.engine, trial.loops, part, newton, context);
    metric.iterations += run.iterations;
    if (run.end != PennerEnd::kConverged) {
      share *= 0.5;
      if (share < kLeastAngleShare) return {};
      continue;
    }
    intrinsic::replay_flips(trial.engine->flips(), first, trial.engine->flips().size(), context,
                            [&](EdgeId e) { trial.reference.flip(e); });
    metric.iterations +=
        come_near(trial, part, kNearlyMet, kDiskNearSteps, kDiskNearEnough, context);
    now = std::move(trial);
    reached = to;
    share = std::min(2.0 * share, kFirstAngleShare);
  }
  if (!finished(now, targets, metric, context)) return {};
  return metric;
}

// The conformal metric, brought nearer.
ConformalMetric from_conformal(const mesh::Surface& disk, const PennerTargets& targets,
                               ExecutionContext& context) {
  conformal::MetricOptions options;
  options.max_iterations = kMostIterations;
  auto found = attempt([&] {
    return conformal::compute_conformal_metric(disk, targets.vertex_angle, options, context);
  });
  if (!found) {
    throw_not_converged(found.error().code,
                        "The metric of a piece of the surface was not reached. Merge vertices that "
                        "nearly coincide (Merge by Distance), spread the cones further apart, or "
                        "use the engine \"penner\".");
  }
  ConformalMetric metric = std::move(*found);
  if (metric.bits > 53) return metric;
  const conformal::EngineInput further = further_input(metric, targets.vertex_angle);
  CarriedMetric carried = carried_from(further, metric, context);
  if (!carried.engine->started()) return metric;
  metric.iterations +=
      come_near(carried, targets, kNearlyMet, kDiskNearSteps, kDiskNearEnough, context);
  finished(carried, targets, metric, context);
  return metric;
}

}  // namespace

ConformalMetric compute_disk_metric(const mesh::Surface& disk, const std::vector<double>& angle,
                                    ExecutionContext& context) {
  const conformal::EngineInput input = input_of(disk, angle);
  const PennerTargets targets{angle, {}};
  auto metric = shortest(input, targets, context);
  if (!metric) metric = stepwise(input, targets, context);
  return metric ? std::move(*metric) : from_conformal(disk, targets, context);
}

namespace {

// A step is halved so many times.
constexpr int kNearHalvings = 3;
constexpr int kNearNewtonSteps = 10;
// Steps that may lead away.
constexpr int kMostDetours = 3;

// The metric after a step of this size and the way back to the targets, if there is one.
std::optional<CarriedMetric> stepped(const CarriedMetric& metric, const PennerTargets& targets,
                                     double tolerance, const std::vector<double>& direction,
                                     double step, ExecutionContext& context) {
  CarriedMetric trial = metric.copy();
  const std::size_t first = trial.engine->flips().size();
  std::vector<double> part = direction;
  for (double& d : part) d *= step;
  trial.engine->stretch(part, context);
  if (!trial.engine->restore_delaunay(context)) return {};
  intrinsic::replay_flips(trial.engine->flips(), first, trial.engine->flips().size(), context,
                          [&](EdgeId e) { trial.loops.flip(e); });
  PennerNewtonOptions newton;
  newton.tolerance = tolerance;
  newton.max_iterations = kNearNewtonSteps;
  if (run_shortest(trial.engine, trial.loops, targets, newton, context).end !=
      PennerEnd::kConverged) {
    return {};
  }
  intrinsic::replay_flips(trial.engine->flips(), first, trial.engine->flips().size(), context,
                          [&](EdgeId e) { trial.reference.flip(e); });
  return trial;
}

}  // namespace

double CarriedMetric::distance() const {
  double sum = 0.0;
  for (const double r : reference.ratios(engine->lengths())) sum += r * r;
  return std::isfinite(sum) ? sum : HUGE_VAL;
}

double CarriedMetric::energy() const {
  const std::vector<double> scale =
      vertex_means(engine->mesh(), reference.ratios(engine->lengths()));
  const double energy = scaling_energy(scale, std::vector<double>(scale.size(), 1.0));
  return std::isfinite(energy) ? energy : HUGE_VAL;
}

int come_near(CarriedMetric& metric, const PennerTargets& targets, double tolerance, int most,
              double enough, ExecutionContext& context) {
  CarriedMetric now = metric.copy();
  double distance = now.distance(), least = distance;
  ShortestSystem system;
  int detours = 0, steps = 0;
  for (; steps < most && now.energy() > enough; ++steps) {
    PennerAngles angles;
    measure(*now.engine, now.loops, targets, angles, context);
    std::vector<double> wish = now.reference.ratios(now.engine->lengths());
    for (double& w : wish) w = -w;
    std::vector<double> direction;
    if (!system.solve(now.engine->mesh(), now.loops, angles, wish, direction, context)) break;
    double largest = 1e-300;
    for (const double d : direction) largest = std::max(largest, std::abs(d));
    std::optional<CarriedMetric> next, detour;
    double reached = 0.0;
    double step = std::min(1.0, kMostRelaxationChange / largest);
    for (int halving = 0; halving < kNearHalvings; ++halving, step *= 0.5) {
      context.check();
      auto trial = stepped(now, targets, tolerance, direction, step, context);
      if (!trial) continue;
      reached = trial->distance();
      if (reached < distance) {
        next = std::move(trial);
        break;
      }
      if (!detour && std::isfinite(reached)) detour = std::move(trial);
    }
    if (!next) {
      if (!detour || ++detours > kMostDetours) break;
      next = std::move(detour);
      reached = next->distance();
    }
    now = std::move(*next);
    distance = reached;
    if (distance < least) {
      least = distance;
      metric = now.copy();
    }
  }
  return steps;
}

}  // namespace flipfree::seamless
