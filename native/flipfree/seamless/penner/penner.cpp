#include "flipfree/seamless/penner/penner.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/conformal/map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/seamless/request.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {
namespace {

// Crossings where 64 bits do not hold the map; what is optimised afterwards need not be near.
constexpr double kSpread = 0.5;

void add_penner_figures(const PennerMetric& metric, Stats& stats) {
  stats["seconds_conformal"] = metric.seconds_conformal;
  stats["seconds_newton"] = metric.seconds_newton;
  stats["relaxed"] = static_cast<std::int64_t>(metric.relaxed);
  stats["iterations"] = static_cast<std::int64_t>(metric.iterations);
  stats["flips"] = static_cast<std::int64_t>(metric.metric.flips.size());
  stats["bits"] = static_cast<std::int64_t>(metric.metric.bits);
  stats["angle_error"] = metric.metric.angle_error;
  stats["loops"] = static_cast<std::int64_t>(metric.loops.size());
}

// Turns a connected map with an aligned boundary so that this runs along the axes.
void turn_boundary_to_axes(certify::Parametrization& map) {
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const std::vector<Index> one_chart(static_cast<std::size_t>(map.surface.faces.rows()), 0);
  turn_to_axes(
      one_chart, 1, [&](HalfedgeId h) { return adjacency.opposite[at(h)] == kInvalid; }, map.uv);
  map.uv32 = map.uv.cast<float>();
}

}  // namespace

PennerMap map_from_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                          PennerMetric solved, const PennerMapOptions& options,
                          ExecutionContext& context) {
  std::vector<double> angles = solved.angles;
  const bool bordered = solved.metric.mesh.symmetric();
  const bool aligned = bordered && options.metric.boundary == Boundary::kAligned;
  for (std::size_t v = 0; bordered && !aligned && v < angles.size(); ++v) {
    if (solved.metric.on_boundary[v]) angles[v] = -1.0;  // not to be certified
  }
  conformal::ConformalMapOptions of_map;
  of_map.uncuttable = options.uncuttable;
  of_map.spread = kSpread;
  Stats stats;
  add_penner_figures(solved, stats);
  conformal::RefinedMetric metric;
  metric.metric = std::move(solved.metric);
  conformal::ConformalMapResult mapped =
      conformal::map_from_metric(surface, angles, std::move(metric), of_map, context);
  if (mapped.map.surface.faces.rows() == 0) throw NotConverged(*mapped.failure);
  PennerMap result{std::move(mapped.map), cones};
  result.map.stats.merge(stats);
  if (aligned) {
    turn_boundary_to_axes(result.map);
    certify::CertifyRequest request;
    request.cone_angles = prescribed_angles(cones, surface.faces, surface.adjacency(), true);
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
    certify::Parametrization& map = whole.map;
    map.surface.vertices = input.vertices;
    whole.cones.assign(at(static_cast<Index>(input.vertices.rows())), 4);
    map.vertex_parent.assign(at(static_cast<Index>(input.vertices.rows())), kInvalid);
    map.vertex_barycentric = Points3::Zero(input.vertices.rows(), 3);
  }

  void add(const mesh::Chart& chart, PennerMap part) {
    certify::Parametrization& from = part.map;
    certify::Parametrization& to = whole_.map;
    // Vertices: those of the chart, then its added ones at the end.
    std::vector<VertexId> own = chart.vertices;
    for (std::size_t v = 0; v < own.size(); ++v) whole_.cones[at(own[v])] = part.cones[v];
    const auto first = static_cast<Index>(own.size());
    const auto count = static_cast<Index>(from.surface.vertices.rows());
    auto end = static_cast<Index>(to.surface.vertices.rows());
    to.surface.vertices.conservativeResize(end + count - first, 3);
    to.vertex_barycentric.conservativeResize(end + count - first, 3);
    to.vertex_parent.resize(at(end + count - first));
    for (Index v = 0; v < count; ++v) {
      if (v >= first) own.push_back(end++);
      to.surface.vertices.row(own[at(v)]) = from.surface.vertices.row(v);
      to.vertex_barycentric.row(own[at(v)]) = from.vertex_barycentric.row(v);
      to.vertex_parent[at(own[at(v)])] = chart.faces[at(from.vertex_parent[at(v)])];
    }
    const Eigen::Index known = to.surface.faces.rows(), added = from.surface.faces.rows();
    Triangles faces = to.surface.faces;
    faces.conservativeResize(known + added, 3);
    for (Eigen::Index f = 0; f < added; ++f) {
      for (int k = 0; k < 3; ++k) faces(known + f, k) = own[at(from.surface.faces(f, k))];
      to.parent_face.push_back(chart.faces[at(from.parent_face[static_cast<std::size_t>(f)])]);
    }
    to.surface.faces = std::move(faces);
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
                         const PennerMapOptions& options, const mesh::Adjacency& adjacency,
                         const ComponentMapper& map_one, ExecutionContext& context) {
  const std::vector<SurfacePart> charts = connected_parts(surface, adjacency, cones);
  mesh::flag_edges(surface.faces, adjacency, options.uncuttable);  // refuses what is no edge
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
    PennerMapOptions own = options;
    own.uncuttable = pairs_in(options.uncuttable, local);
    for (const VertexId v : vertices) local[at(v)] = kInvalid;
    PennerMap found;
    try {
      found = map_one(charts[i].surface, charts[i].cones, own_loops, own, charts[i].faces, context);
    } catch (...) {
      rethrow_placed(charts[i].faces, vertices);
    }
    merger.add(charts[i], std::move(found));
  }
  Points2& uv = whole.map.uv;
  uv /= std::max(uv.col(0).maxCoeff(), uv.col(1).maxCoeff());
  whole.map.uv32 = uv.cast<float>();
  certify::CertifyRequest request;
  request.cone_angles = prescribed_angles(
      whole.cones, surface.faces, adjacency,
      options.metric.boundary == Boundary::kAligned || options.metric.boundary == Boundary::kGiven);
  certify::certify_map(whole.map, surface, request, context);
  return whole;
}

}  // namespace

PennerMap map_each_component(const mesh::Surface& surface, const std::vector<Index>& given,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerMapOptions& options, const ComponentMapper& map_one,
                             ExecutionContext& context) {
  check_surface(surface, context);
  if (given.size() != static_cast<std::size_t>(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "cones need one number per vertex.");
  const mesh::Adjacency& adjacency = surface.adjacency();
  const std::vector<Index> cones = flat_inside(given, adjacency);
  std::vector<FaceId> all(static_cast<std::size_t>(surface.faces.rows()));
  std::iota(all.begin(), all.end(), FaceId{0});
  PennerMap result =
      mesh::face_components(adjacency).count == 1
          ? map_one(surface, cones, loops, options, all, context)
          : map_components(surface, cones, loops, options, adjacency, map_one, context);
  if (result.map.certificate.flips64 != 0)
    throw certify::CertificateFailed("The seamless map", certify::in_input_faces(result.map));
  return result;
}

PennerMap compute_penner_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                             const std::optional<std::vector<LoopTurn>>& loops,
                             const PennerMapOptions& options, ExecutionContext& context) {
  const ComponentMapper map_one = [](const mesh::Surface& component,
                                     const std::vector<Index>& given,
                                     const std::optional<std::vector<LoopTurn>>& own_loops,
                                     PennerMapOptions own, const std::vector<FaceId>&,
                                     ExecutionContext& inner) {
    if (own.metric.boundary == Boundary::kGiven) {
      const bool all = std::find(given.begin(), given.end(), kNotGiven) == given.end();
      own.metric.boundary = all ? Boundary::kAligned : Boundary::kFree;
    }
    const std::vector<Index> turns =
        own.metric.boundary == Boundary::kAligned ? aligned_cones(component, given, inner) : given;
    PennerMetric metric;
    {
      const ProgressRange range(inner, 0.0, 0.7);
      metric = compute_penner_metric(component, turns, own_loops, own.metric, inner);
    }
    const ProgressRange range(inner, 0.7, 1.0);
    return map_from_metric(component, turns, std::move(metric), own, inner);
  };
  return map_each_component(surface, cones, loops, options, map_one, context);
}

}  // namespace flipfree::seamless
