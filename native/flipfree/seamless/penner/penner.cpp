#include "flipfree/seamless/penner/penner.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "flipfree/seamless/request.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {

using conformal::ConformalMetric;

std::vector<LoopTurn> loops_to_turn(const mesh::Surface& surface, bool aligned,
                                    const ExecutionContext& context) {
  std::vector<LoopTurn> loops;
  for (auto& loop : intrinsic::tree_cotree(surface, context).loops)
    loops.push_back({std::move(loop), 0});
  if (!aligned) return loops;
  for (auto& strip : intrinsic::strips_between(surface, context))
    loops.push_back({std::move(strip), 0, true});
  return loops;
}

namespace {

// The loops on the mesh of `setup`; strips between boundaries are closed by their mirror images.
// Throws InvalidInput as on_setup().
std::vector<intrinsic::DualLoop> loops_on_setup(const std::vector<LoopTurn>& loops,
                                                const Triangles& faces,
                                                const intrinsic::IntrinsicSetup& setup) {
  std::vector<intrinsic::DualLoop> closed, open;
  for (const LoopTurn& loop : loops) {
    if (!loop.between_boundaries) {
      closed.push_back(loop.loop);
      continue;
    }
    intrinsic::DualLoop strip;
    for (const HalfedgeId h : loop.loop) strip.push_back(setup.input_halfedge[at(h)]);
    strip.front() ^= 1;
    open.push_back(intrinsic::closed_by_reflection(setup.mesh, strip));
  }
  auto all = intrinsic::on_setup(closed, faces, setup);
  all.insert(all.end(), open.begin(), open.end());
  return all;
}

// How many quarter turns the loop on the mesh turns by: a strip between boundaries once each way.
Index whole_turns(const LoopTurn& loop, Index turns) {
  return loop.between_boundaries ? 2 * turns : turns;
}

// Quarter turns of the vertices of the closed surface, or of the double cover, that are not flat.
std::vector<Index> cones_of_double(const std::vector<Index>& cones,
                                   const intrinsic::IntrinsicSetup& setup) {
  std::vector<Index> out;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    const bool twice = setup.mesh.symmetric() && !setup.on_boundary[v];
    const Index k = setup.on_boundary[v] ? 2 * cones[v] : cones[v];
    if (k == 4) continue;
    out.insert(out.end(), twice ? 2 : 1, k);
  }
  return out;
}

// Quarter turns of loops that generate the homology of the double cover of a surface with an
// aligned boundary, some of them twice: `loops` turned by `turns`, and the curves of the boundary.
std::vector<Index> turns_of_double(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   const std::vector<LoopTurn>& loops,
                                   const std::vector<Index>& turns) {
  std::vector<Index> all;
  for (std::size_t i = 0; i < turns.size(); ++i) all.push_back(whole_turns(loops[i], turns[i]));
  const auto curves = mesh::boundary_loops(surface.faces, surface.adjacency());
  for (const auto& curve : curves) {
    all.push_back(0);
    for (const VertexId v : curve) all.back() += 2 - cones[at(v)];
  }
  return all;
}

// Steps towards the input's metric: while the scale alone makes for more energy than `enough`, and
// `most` of them. Of a metric that is to be finished all vertices count alike, and every step meets
// the angles as well as `tolerance`, as what is left is met by conformal changes.
constexpr Nearing kRelaxing{kNearlyMet, 8, 100.0}, kFinishing{1e-6, 4, 1.5};

std::string scientific(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", value);
  return text;
}

// A third of the triangles around.
std::vector<double> vertex_areas(const mesh::Surface& surface) {
  std::vector<double> area(at(surface.vertices.rows()), 0.0);
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    const auto [a, b] = mesh::sides_at(surface, 3 * f);
    for (int k = 0; k < 3; ++k) area[at(surface.faces(f, k))] += a.cross(b).norm() / 6.0;
  }
  return area;
}

class PennerSolver {
 public:
  PennerSolver(const mesh::Surface& surface, const std::vector<Index>& cones,
               const PennerOptions& options, ExecutionContext& context)
      : surface_(surface), cones_(cones), options_(options), context_(context) {
    const auto vertex_count = static_cast<Index>(surface.vertices.rows());
    setup_ = intrinsic::build_intrinsic_mesh(vertex_count, surface.faces);
    const auto euler = static_cast<Index>(setup_.mesh.vertex_count() + setup_.mesh.face_count()) -
                       static_cast<Index>(setup_.mesh.edge_count());
    genus_ = (2 - euler) / 2;
    if (!setup_.mesh.symmetric()) check_cones(cones, genus_);
    free_ = setup_.mesh.symmetric() && options.boundary != Boundary::kAligned;
    if (free_) {
      const ProgressRange range(context, 0.0, 0.2);
      targets_.vertex_angle = free_angles(surface, cones, options.boundary, context);
    } else {
      for (const Index k : cones) targets_.vertex_angle.push_back(k * kQuarterTurn);
    }
  }

  // `start_metric`: null, or one to be finished.
  PennerMetric run(const std::optional<std::vector<LoopTurn>>& given,
                   ConformalMetric* start_metric) {
    PennerMetric result;
    if (start_metric != nullptr) result.metric = std::move(*start_metric);
    finishing_ = start_metric != nullptr;
    result.angles = targets_.vertex_angle;
    result.stats = {{"relaxed", std::int64_t{0}}, {"seconds_newton", 0.0}};
    result.loops = given ? *given : loops_to_turn(surface_, !free_, context_);
    if (given && static_cast<Index>(result.loops.size()) != loop_count()) {
      throw_invalid(ErrorCode::kBadOption, "A surface of this genus has " +
                                               std::to_string(loop_count()) +
                                               " independent loops, strips between its boundaries "
                                               "counted where they are aligned, not " +
                                               std::to_string(result.loops.size()) + ".");
    }
    if (given) refuse_impossible(*given);
    intrinsic::LoopCarrier loops(setup_.mesh, loops_on_setup(result.loops, surface_.faces, setup_));
    start(result, loops, given.has_value());
    // Cones that are met leave the loops of a torus without cones no choice; nor those of a tube.
    const bool flat = genus_ == 1 && !free_ && cones_of_double(cones_, setup_).empty();
    if (!result.loops.empty() && (!flat || finishing_)) reach_turns(result, loops);
    if (!flat) relax(result, loops);
    finish(result.metric, loops);
    result.stats["iterations"] = static_cast<std::int64_t>(iterations_);
    result.stats["flips"] = static_cast<std::int64_t>(result.metric.flips.size());
    result.stats["bits"] = static_cast<std::int64_t>(result.metric.bits);
    result.stats["angle_error"] = result.metric.angle_error;
    result.stats["loops"] = static_cast<std::int64_t>(result.loops.size());
    return result;
  }

 private:
  // How many loops there are to choose the turns of. The double of a surface of genus g with b
  // boundaries has the genus 2 g + b - 1.
  Index loop_count() const {
    if (!setup_.mesh.symmetric()) return 2 * genus_;
    if (!free_) return genus_;
    const auto curves = mesh::boundary_loops(surface_.faces, surface_.adjacency());
    return genus_ - static_cast<Index>(curves.size()) + 1;
  }

  // Why no metric turns so along the loops; empty if one does, or nobody knows.
  std::string why_not(const std::vector<LoopTurn>& loops, const std::vector<Index>& turns) const {
    if (free_) return "";
    return why_impossible(cones_of_double(cones_, setup_), genus_,
                          turns_of_double(surface_, cones_, loops, turns));
  }

  void refuse_impossible(const std::vector<LoopTurn>& given) const {
    std::vector<Index> turns;
    for (const LoopTurn& loop : given) turns.push_back(loop.quarter_turns);
    const std::string why = why_not(given, turns);
    if (why.empty()) return;
    std::vector<double> numbers(turns.begin(), turns.end());
    throw_infeasible(ErrorCode::kBadAngles, why + " Change a cone or the turns of a loop.",
                     {"empty stratum",
                      {{"genus", {static_cast<double>(genus_)}}, {"turns", std::move(numbers)}}});
  }

  // `loops`: on the metric's triangulation, which doubles may see as not quite Delaunay. `norm`:
  // null, or for what it costs there to turn loops by other quarters; the identity if that is not
  // known.
  PennerAngles measured(const ConformalMetric& metric, const intrinsic::LoopCarrier& loops,
                        Eigen::MatrixXd* norm) {
    const LoopedMetric looped(metric, targets_, loops, metric.bits, context_);
    PennerAngles angles = measure(looped, targets_, context_);
    if (norm != nullptr) *norm = norm_of_turns(looped, angles, context_);
    return angles;
  }

  // The conformal metric with these cones; the loops are carried there.
  void start(PennerMetric& result, intrinsic::LoopCarrier& loops, bool turns_given) {
    const Stopwatch watch;
    if (!finishing_) {
      result.metric =
          conformal::compute_conformal_metric(surface_, targets_.vertex_angle, {}, context_);
    }
    intrinsic::replay_flips(result.metric.flips, 0, result.metric.flips.size(), context_,
                            [&](EdgeId e) { loops.flip(e); });
    targets_.loop_angle.assign(loops.size(), 0.0);
    Eigen::MatrixXd norm;
    const PennerAngles angles = measured(result.metric, loops, turns_given ? nullptr : &norm);
    if (turns_given) {
      for (const LoopTurn& loop : result.loops) turns_.push_back(loop.quarter_turns);
    } else {
      std::vector<double> own;
      for (std::size_t i = 0; i < result.loops.size(); ++i)
        own.push_back(-angles.loops[i] / whole_turns(result.loops[i], 1));
      turns_ = turns_near(result.loops, own, std::move(norm));
    }
    for (std::size_t i = 0; i < turns_.size(); ++i) {
      result.loops[i].quarter_turns = turns_[i];
      targets_.loop_angle[i] = whole_turns(result.loops[i], turns_[i]) * kQuarterTurn;
    }
    result.stats["seconds_conformal"] = watch.seconds();
  }

  // `angles`: of the loops, radians.
  std::vector<Index> turns_near(const std::vector<LoopTurn>& loops,
                                const std::vector<double>& angles, Eigen::MatrixXd norm) const {
    // Strips between boundaries turn twice on the double cover.
    for (std::size_t i = 0; i < loops.size(); ++i) {
      const double turns = whole_turns(loops[i], 1);
      norm.row(static_cast<Eigen::Index>(i)) *= turns;
      norm.col(static_cast<Eigen::Index>(i)) *= turns;
    }
    if (!setup_.mesh.symmetric()) return near_turns(cones_, genus_, angles, norm);
    std::string said;
    const auto why = [&](const std::vector<Index>& tried) { return said = why_not(loops, tried); };
    const auto turns = near_turns(angles, norm, why);
    if (!turns) {
      throw_infeasible(
          ErrorCode::kBadAngles,
          "No flat surface has these corners. Of its double, two copies glued along "
          "the boundary: " +
              said + " Move one of the corners to another boundary, or give more.",
          {"empty stratum",
           {{"genus", {static_cast<double>(genus_)}},
            {"boundary corners", {static_cast<double>(cones_of_double(cones_, setup_).size())}}}});
    }
    return *turns;
  }

  // By Newton's method.
  void reach_turns(PennerMetric& result, intrinsic::LoopCarrier& loops) {
    const Stopwatch watch;
    PennerNewtonOptions newton;
    newton.max_iterations = options_.max_iterations;
    LoopedMetric looped(result.metric, targets_, loops, result.metric.bits, context_);
    last_ = run_penner(looped, targets_, newton, context_);
    loops = looped.loops;
    looped.append_to(result.metric, context_);
    result.stats["seconds_newton"] = watch.seconds();
    require_reached(result.metric.bits);
  }

  // Of the last run of Newton's method.
  void require_reached(int bits) {
    iterations_ += last_.iterations;
    if (last_.end == PennerEnd::kConverged) return;
    throw_not_converged(
        last_.end == PennerEnd::kIterations ? ErrorCode::kIterationLimit
                                            : ErrorCode::kLineSearchStalled,
        "The seamless metric was not reached: the largest angle error is " +
            scientific(last_.error) + " radians after " + std::to_string(iterations_) +
            " Newton steps with " + std::to_string(bits) +
            " bits. Spread the curvature over more vertices, or refine the mesh near the cones.");
  }

  // Steps towards the input's metric, as many as the scale asks for.
  void relax(PennerMetric& result, intrinsic::LoopCarrier& loops) {
    ConformalMetric& metric = result.metric;
    const Nearing& nearing = finishing_ ? kFinishing : kRelaxing;
    const std::vector<double> area = finishing_
                                         ? std::vector<double>(targets_.vertex_angle.size(), 1.0)
                                         : vertex_areas(surface_);
    if (metric.bits > 53 || scaling_energy(metric.scale_factors, area) <= nearing.enough) return;
    CarriedMetric carried(metric, targets_, loops, context_);
    // What a padded metric is far off by is shear, which conformal changes would lead back to.
    const Meeting how = finishing_ ? Meeting::kShortest : Meeting::kConformal;
    const int steps = carried.come_near(targets_, how, nearing, area, context_);
    result.stats["relaxed"] = static_cast<std::int64_t>(steps);
    if (steps == 0) return;
    // All angles, as well as asked for.
    last_ = carried.meet(targets_, Meeting::kConformal, {}, context_);
    require_reached(metric.bits);
    carried.append_to(metric, context_);
    loops = carried.loops;
  }

  // The errors of the final lengths, rounded to double as they are for the layout at worst.
  void finish(ConformalMetric& metric, const intrinsic::LoopCarrier& loops) {
    const PennerAngles angles = measured(metric, loops, nullptr);
    metric.angle_error = angles.max_error;
    for (std::size_t v = 0; v < targets_.vertex_angle.size(); ++v)
      metric.angles[v] = targets_.vertex_angle[v] - angles.vertices.value[v];
  }

  const mesh::Surface& surface_;
  const std::vector<Index>& cones_;
  const PennerOptions& options_;
  ExecutionContext& context_;
  intrinsic::IntrinsicSetup setup_;
  Index genus_ = 0;         // of the double cover, if the surface has a boundary
  bool free_ = false;       // is its boundary
  bool finishing_ = false;  // a metric that was given
  PennerTargets targets_;
  std::vector<Index> turns_;  // of the loops, quarters
  PennerRun last_;
  int iterations_ = 0;  // of Newton's method, in all
};

}  // namespace

PennerMetric compute_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   const std::optional<std::vector<LoopTurn>>& loops,
                                   const PennerOptions& options, ExecutionContext& context) {
  return PennerSolver(surface, cones, options, context).run(loops, nullptr);
}

PennerMetric finish_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                  ConformalMetric start, const PennerOptions& options,
                                  ExecutionContext& context) {
  return PennerSolver(surface, cones, options, context).run(std::nullopt, &start);
}

namespace {

// Crossings where 64 bits do not hold the map; what is optimised afterwards need not be near.
constexpr double kSpread = 0.5;

// Turns a connected map with an aligned boundary so that this runs along the axes.
void turn_boundary_to_axes(certify::Parametrization& map) {
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const std::vector<Index> one_chart(at(map.surface.faces.rows()), 0);
  turn_to_axes(
      one_chart, 1, [&](HalfedgeId h) { return adjacency.opposite[at(h)] == kInvalid; }, map.uv);
  map.uv32 = map.uv.cast<float>();
}

}  // namespace

PennerMap map_from_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                          PennerMetric solved, const PennerOptions& options,
                          ExecutionContext& context) {
  std::vector<double> angles = solved.angles;
  const bool bordered = solved.metric.mesh.symmetric();
  const bool aligned = bordered && options.boundary == Boundary::kAligned;
  for (std::size_t v = 0; bordered && !aligned && v < angles.size(); ++v) {
    if (solved.metric.on_boundary[v]) angles[v] = -1.0;  // not to be certified
  }
  conformal::ConformalMapOptions of_map;
  of_map.uncuttable = options.uncuttable;
  of_map.spread = kSpread;
  conformal::RefinedMetric metric;
  metric.metric = std::move(solved.metric);
  conformal::ConformalMapResult mapped =
      conformal::map_from_metric(surface, angles, std::move(metric), of_map, context);
  if (mapped.map.surface.faces.rows() == 0) throw NotConverged(*mapped.failure);
  PennerMap result{std::move(mapped.map), cones};
  result.map.stats.merge(solved.stats);
  if (aligned) {
    turn_boundary_to_axes(result.map);
    certify::CertifyRequest request;
    request.cone_angles = prescribed_angles(cones, surface, true);
    certify::certify_map(result.map, surface, request, context);
  }
  return result;
}

namespace {

double area(const Points2& uv) {
  double sum = 0.0;
  for (Eigen::Index c = 0; c < uv.rows(); c += 3) {
    const Vector2 a = uv.row(c + 1) - uv.row(c), b = uv.row(c + 2) - uv.row(c);
    sum += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return sum;
}

// Where the rows of one component go in the whole.
class Merger {
 public:
  Merger(const mesh::Surface& input, PennerMap& whole) : whole_(whole) {
    whole.map.surface.vertices = input.vertices;
    whole.cones.assign(at(input.vertices.rows()), 4);
  }

  void add(const mesh::Chart& chart, const PennerMap& part) {
    const certify::Parametrization& from = part.map;
    certify::Parametrization& to = whole_.map;
    const std::vector<VertexId> own = append_part(chart, from.surface, to.surface);
    to.vertex_barycentric.conservativeResize(to.surface.vertices.rows(), 3);
    to.vertex_parent.resize(at(to.surface.vertices.rows()), kInvalid);
    for (std::size_t v = 0; v < own.size(); ++v) {
      if (v < part.cones.size()) whole_.cones[at(own[v])] = part.cones[v];
      to.vertex_barycentric.row(own[v]) = from.vertex_barycentric.row(static_cast<Eigen::Index>(v));
      to.vertex_parent[at(own[v])] = chart.faces[at(from.vertex_parent[v])];
    }
    for (const FaceId f : from.parent_face) to.parent_face.push_back(chart.faces[at(f)]);
    const Eigen::Index cuts = to.cut_edges.rows();
    to.cut_edges.conservativeResize(cuts + from.cut_edges.rows(), 2);
    for (Eigen::Index e = 0; e < from.cut_edges.rows(); ++e) {
      for (int k = 0; k < 2; ++k) to.cut_edges(cuts + e, k) = own[at(from.cut_edges(e, k))];
    }
    place(chart, from.uv);
    for (const auto& [name, value] : from.stats) add_stat(name, value);
  }

 private:
  // Right of what is there, at the scale of the surface.
  void place(const mesh::Chart& chart, const Points2& uv) {
    Points2& all = whole_.map.uv;
    const double scale = std::sqrt(mesh::area_of(chart.surface) / area(uv));
    const Eigen::Index before = all.rows();
    all.conservativeResize(before + uv.rows(), 2);
    const double left = scale * uv.col(0).minCoeff(), low = scale * uv.col(1).minCoeff();
    const double width = scale * uv.col(0).maxCoeff() - left;
    for (Eigen::Index c = 0; c < uv.rows(); ++c)
      all.row(before + c) << scale * uv(c, 0) - left + right_, scale * uv(c, 1) - low;
    right_ += 1.02 * width;
  }
  void add_stat(const std::string& name, const StatValue& value) {
    StatValue& sum = whole_.map.stats[name];
    if (const auto* number = std::get_if<std::int64_t>(&value)) {
      const auto* before = std::get_if<std::int64_t>(&sum);
      sum = *number + (before == nullptr ? 0 : *before);
    } else if (const auto* figure = std::get_if<double>(&value)) {
      const auto* before = std::get_if<double>(&sum);
      sum = *figure + (before == nullptr ? 0.0 : *before);
    }
  }

  PennerMap& whole_;
  double right_ = 0.0;
};

// The loops that lie in a chart, in its own faces.
std::vector<LoopTurn> loops_in(const mesh::Chart& chart, const std::vector<LoopTurn>& loops) {
  std::vector<LoopTurn> own;
  for (const LoopTurn& loop : loops) {
    const auto local = [&](HalfedgeId h) {
      const auto place = std::lower_bound(chart.faces.begin(), chart.faces.end(), h / 3);
      return place == chart.faces.end() || *place != h / 3
                 ? kInvalid
                 : static_cast<HalfedgeId>(3 * (place - chart.faces.begin())) + h % 3;
    };
    if (loop.loop.empty() || local(loop.loop.front()) == kInvalid) continue;
    LoopTurn mine{{}, loop.quarter_turns, loop.between_boundaries};
    for (const HalfedgeId h : loop.loop) mine.loop.push_back(local(h));
    own.push_back(std::move(mine));
  }
  return own;
}

// The pairs between vertices of a chart, in its own numbers; `local`: those of the vertices.
IndexPairs pairs_in(const IndexPairs& pairs, const std::vector<VertexId>& local) {
  IndexPairs own(pairs.rows(), 2);
  Eigen::Index count = 0;
  for (Eigen::Index e = 0; e < pairs.rows(); ++e) {
    const VertexId a = local[at(pairs(e, 0))], b = local[at(pairs(e, 1))];
    if (a != kInvalid && b != kInvalid) own.row(count++) << a, b;
  }
  own.conservativeResize(count, 2);
  return own;
}

PennerMap map_components(const mesh::Surface& surface, const std::vector<Index>& cones,
                         const std::optional<std::vector<LoopTurn>>& loops,
                         const PennerOptions& options, const ComponentMapper& map_one,
                         ExecutionContext& context) {
  const std::vector<SurfacePart> charts = connected_parts(surface, cones);
  // Refuses what is no edge.
  mesh::flag_edges(surface.faces, surface.adjacency(), options.uncuttable);
  PennerMap whole;
  Merger merger(surface, whole);
  std::vector<VertexId> local(cones.size(), kInvalid);
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const ProgressRange range(context, i, charts.size());
    const std::vector<VertexId>& vertices = charts[i].vertices;
    for (std::size_t v = 0; v < vertices.size(); ++v)
      local[at(vertices[v])] = static_cast<VertexId>(v);
    std::optional<std::vector<LoopTurn>> own_loops;
    if (loops) own_loops = loops_in(charts[i], *loops);
    PennerOptions own = options;
    own.uncuttable = pairs_in(options.uncuttable, local);
    for (const VertexId v : vertices) local[at(v)] = kInvalid;
    const Component component{charts[i].surface, charts[i].cones, own_loops, own,
                              charts[i].faces,   context};
    merger.add(charts[i], placed(component.faces, vertices, [&] { return map_one(component); }));
  }
  Points2& uv = whole.map.uv;
  uv /= std::max(uv.col(0).maxCoeff(), uv.col(1).maxCoeff());
  whole.map.uv32 = uv.cast<float>();
  certify::CertifyRequest request;
  request.cone_angles = prescribed_angles(
      whole.cones, surface,
      options.boundary == Boundary::kAligned || options.boundary == Boundary::kGiven);
  certify::certify_map(whole.map, surface, request, context);
  return whole;
}

}  // namespace

PennerMap map_each_component(const mesh::Surface& surface, const std::vector<Index>& given,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerOptions& options, const ComponentMapper& map_one,
                             ExecutionContext& context) {
  check_surface(surface, context);
  if (given.size() != at(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "cones need one number per vertex.");
  const std::vector<Index> cones = flat_inside(given, surface);
  std::vector<FaceId> all(at(surface.faces.rows()));
  std::iota(all.begin(), all.end(), FaceId{0});
  PennerMap result = mesh::face_components(surface.adjacency()).count == 1
                         ? map_one({surface, cones, loops, options, all, context})
                         : map_components(surface, cones, loops, options, map_one, context);
  if (result.map.certificate.flips64 != 0)
    throw certify::CertificateFailed("The seamless map", certify::in_input_faces(result.map));
  return result;
}

PennerMap compute_penner_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerOptions& options, ExecutionContext& context) {
  const ComponentMapper map_one = [](const Component& part) {
    PennerOptions own = part.options;
    if (own.boundary == Boundary::kGiven) {
      const bool all =
          std::find(part.cones.begin(), part.cones.end(), kNotGiven) == part.cones.end();
      own.boundary = all ? Boundary::kAligned : Boundary::kFree;
    }
    const std::vector<Index> turns = own.boundary == Boundary::kAligned
                                         ? aligned_cones(part.surface, part.cones, part.context)
                                         : part.cones;
    PennerMetric metric;
    {
      const ProgressRange range(part.context, 0.0, 0.7);
      metric = compute_penner_metric(part.surface, turns, part.loops, own, part.context);
    }
    const ProgressRange range(part.context, 0.7, 1.0);
    return map_from_metric(part.surface, turns, std::move(metric), own, part.context);
  };
  return map_each_component(surface, cones, loops, options, map_one, context);
}

}  // namespace flipfree::seamless
