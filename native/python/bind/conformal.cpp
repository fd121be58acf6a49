// Conformal metrics and maps, and the angles for them.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/conformal/map.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/conformal/suggest_cones.h"
#include "flipfree/numeric/scalar.h"
#include "job.h"

namespace flipfree::python {

using namespace pybind11::literals;

namespace {

// Final triangulation as the single cover sees it: vertices of the user's mesh, natural logarithms
// of lengths.
void add_triangulation(const conformal::ConformalMetric& metric, py::dict& d) {
  const intrinsic::IntrinsicMesh& mesh = metric.mesh;
  Triangles faces(static_cast<Eigen::Index>(mesh.face_count()), 3);
  Points3 log_length(faces.rows(), 3);
  std::vector<std::int8_t> label(mesh.face_count());
  std::visit(
      [&](const auto& length) {
        using Traits = numeric::ScalarTraits<typename std::decay_t<decltype(length)>::value_type>;
        for (std::size_t f = 0; f < mesh.face_count(); ++f) {
          HalfedgeId h = mesh.face_halfedge[f];
          if (!mesh.face_label.empty()) label[f] = static_cast<std::int8_t>(mesh.face_label[f]);
          for (int k = 0; k < 3; ++k, h = mesh.next[at(h)]) {
            const auto row = static_cast<Eigen::Index>(f);
            faces(row, k) = mesh.unknown[at(mesh.origin[at(h)])];
            // With many bits a logarithm in full takes half a millisecond.
            std::int64_t exponent = 0;
            const double mantissa = Traits::scaled(length[at(h >> 1)], exponent);
            const bool near_one = exponent >= -1 && exponent <= 1;
            log_length(row, k) =
                near_one ? std::log(std::ldexp(mantissa, static_cast<int>(exponent)))
                         : std::log(mantissa) + std::numbers::ln2 * static_cast<double>(exponent);
          }
        }
      },
      metric.length);
  d["faces"] = std::move(faces);
  d["log_lengths"] = std::move(log_length);
  d["face_labels"] = std::move(label);
}

}  // namespace

// What flipfree/results.py makes its ConformalMetric of.
py::object to_python(const conformal::ConformalMetric& metric) {
  const auto own = static_cast<std::ptrdiff_t>(metric.scale_factors.size() - metric.added.size());
  const auto begin = metric.scale_factors.begin();
  std::vector<FaceId> parent;
  Points3 weights(static_cast<Eigen::Index>(metric.added.size()), 3);
  for (const mesh::SurfacePoint& v : metric.added) {
    weights.row(static_cast<Eigen::Index>(parent.size())) = v.weight.transpose();
    parent.push_back(v.face);
  }
  py::dict d("scale_factors"_a = std::vector<double>(begin, begin + own),
             "angles"_a = std::vector<double>(metric.angles.begin(), metric.angles.begin() + own),
             "added_scale_factors"_a = std::vector<double>(begin + own, metric.scale_factors.end()),
             "added_parent"_a = std::move(parent), "added_barycentric"_a = std::move(weights),
             "angle_error"_a = metric.angle_error, "scale_range"_a = metric.scale_range,
             "flips"_a = metric.flips.size() - metric.euclidean_flips,
             "euclidean_flips"_a = metric.euclidean_flips,
             "flip_counts"_a = py::tuple(py::cast(
                 std::vector<std::size_t>(metric.flip_counts.begin(), metric.flip_counts.end()))),
             "iterations"_a = metric.iterations, "bits"_a = metric.bits,
             "converged"_a = metric.converged, "error_history"_a = metric.error_history,
             "symmetric"_a = metric.mesh.symmetric(), "stats"_a = metric.stats);
  add_triangulation(metric, d);
  return d;
}

// {map, log_weight, figures, error, metric}: error is None or what flipfree.errors take, with the
// metric; the map is valid only without one.
py::object to_python(conformal::ConformalMapResult&& result) {
  const conformal::ConformalMetric& metric = result.metric;
  const bool failed = result.failure.has_value();
  return py::dict(
      "map"_a = std::move(result.map), "log_weight"_a = std::move(result.log_weight),
      "error"_a = result.failure, "metric"_a = failed ? to_python(metric) : py::none(),
      "figures"_a = py::dict("angle_error"_a = metric.angle_error,
                             "scale_range"_a = metric.scale_range, "flips"_a = metric.flips.size(),
                             "iterations"_a = metric.iterations, "bits"_a = metric.bits));
}

namespace {

// What metric and map are of.
struct Request {
  std::vector<double> target_angles;
  std::optional<Points3> lengths;

  const Points3* own_lengths() const { return lengths ? &*lengths : nullptr; }
};

Request read_metric_request(OptionReader& read) {
  Request request;
  FLIPFREE_READ(read, request, target_angles, lengths);
  return request;
}

conformal::MetricOptions read_metric(OptionReader& read) {
  conformal::MetricOptions options;
  FLIPFREE_READ(read, options, tolerance, bits, max_seconds, require_convergence);
  read("iterations", options.max_iterations);
  return options;
}

bool read_refinement(OptionReader& read) {
  bool refined = false;
  read.choice("intrinsic_refinement", refined, {{"auto", false}, {"on", true}, {"off", false}});
  return refined;
}

conformal::ConformalMapOptions read_map(OptionReader& read) {
  using intrinsic::Refinement;
  conformal::ConformalMapOptions options;
  FLIPFREE_READ(read, options, cuts, uncuttable);
  read.choice(
      "refinement", options.refinement,
      {{"auto", Refinement::kAuto}, {"never", Refinement::kNever}, {"full", Refinement::kFull}});
  options.metric = read_metric(read);
  options.refined_start = read_refinement(read);
  return options;
}

conformal::SuggestConesOptions read_cones(OptionReader& read) {
  conformal::SuggestConesOptions options;
  FLIPFREE_READ(read, options, bound, max_cones, quantum, least_angle, max_seconds);
  return options;
}

conformal::BoundaryAnglesOptions read_boundary(OptionReader& read) {
  using conformal::BoundaryGoal;
  conformal::BoundaryAnglesOptions options;
  read.choice("boundary", options.shape,
              {{"free", BoundaryGoal::kFree},
               {"straight", BoundaryGoal::kStraight},
               {"circle", BoundaryGoal::kCircle}});
  FLIPFREE_READ(read, options, cones, corners, max_seconds);
  return options;
}

}  // namespace

void bind_conformal(py::module_& module) {
  const auto metric = [](const auto& surface, const Request& request, const auto& options,
                         bool refined, auto& context) {
    return conformal::compute_refined_metric(surface, request.own_lengths(), request.target_angles,
                                             options, refined, context)
        .metric;
  };
  def_job(module, "conformal_metric",
          prepared(metric, read_metric_request, read_metric, read_refinement));
  const auto map = [](const auto& surface, const Request& request, const auto& options,
                      auto& context) {
    return conformal::conformal_map(surface, request.own_lengths(), request.target_angles, options,
                                    context);
  };
  def_job(module, "conformal", prepared(map, read_metric_request, read_map));
  const auto suggest = [](const auto& surface, const auto& options, auto& context) {
    const conformal::SuggestedCones found = conformal::suggest_cones(surface, options, context);
    return std::tuple(found.target_angles, found.cones, found.scale_ratio, found.bound_holds);
  };
  def_job(module, "suggest_cones", prepared(suggest, read_cones));
  def_job(module, "boundary_angles", prepared(&conformal::boundary_angles, read_boundary));
}

}  // namespace flipfree::python
