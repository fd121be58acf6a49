#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/stl.h>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/conformal/refined_metric.h"
#include "flipfree/numeric/scalar.h"
#include "job.h"
#include "metric_object.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

struct MetricRequest {
  mesh::Surface surface;
  std::optional<Points3> lengths;
  std::vector<double> target_angles;
  conformal::MetricOptions options;
  conformal::StartRefinement refinement = conformal::StartRefinement::kAuto;
};

conformal::ConformalMetric solve(const MetricRequest& request, ExecutionContext& context) {
  return conformal::compute_refined_metric(
             request.surface, request.lengths ? &*request.lengths : nullptr, request.target_angles,
             request.options, request.refinement, context)
      .metric;
}

// The vertices that were added: scale factors and where they lie on the user's surface.
void add_refinement(const conformal::ConformalMetric& metric, py::dict& d) {
  const std::size_t own = metric.scale_factors.size() - metric.added.size();
  const auto part = [own](const std::vector<double>& v) {
    return std::vector<double>(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(own));
  };
  d["scale_factors"] = from_vector(part(metric.scale_factors));
  d["angles"] = from_vector(part(metric.angles));
  d["added_scale_factors"] = from_vector(std::vector<double>(
      metric.scale_factors.begin() + static_cast<std::ptrdiff_t>(own), metric.scale_factors.end()));
  std::vector<FaceId> parent;
  Points3 weights(static_cast<Eigen::Index>(metric.added.size()), 3);
  for (const mesh::SurfacePoint& v : metric.added) {
    weights.row(static_cast<Eigen::Index>(parent.size())) = v.weight.transpose();
    parent.push_back(v.face);
  }
  d["added_parent"] = from_vector(parent);
  d["added_barycentric"] = from_matrix(weights);
}

// Final triangulation as the single cover sees it: vertices of the user's mesh, natural logarithms
// of lengths.
void add_mesh(const conformal::ConformalMetric& metric, py::dict& d) {
  const intrinsic::IntrinsicMesh& mesh = metric.mesh;
  Triangles faces(static_cast<Eigen::Index>(mesh.face_count()), 3);
  Points3 log_length(faces.rows(), 3);
  std::vector<std::int8_t> label(mesh.face_count());
  std::visit(
      [&](const auto& length) {
        using Traits = numeric::ScalarTraits<typename std::decay_t<decltype(length)>::value_type>;
        for (std::size_t f = 0; f < mesh.face_count(); ++f) {
          HalfedgeId h = mesh.face_halfedge[f];
          label[f] = static_cast<std::int8_t>(mesh.label_of_face(static_cast<FaceId>(f)));
          for (int k = 0; k < 3; ++k, h = mesh.next[static_cast<std::size_t>(h)]) {
            const auto row = static_cast<Eigen::Index>(f);
            faces(row, k) =
                mesh.unknown[static_cast<std::size_t>(mesh.origin[static_cast<std::size_t>(h)])];
            // With many bits a logarithm in full takes half a millisecond.
            std::int64_t exponent = 0;
            const double mantissa =
                Traits::scaled(length[static_cast<std::size_t>(h >> 1)], exponent);
            const bool near_one = exponent >= -1 && exponent <= 1;
            log_length(row, k) =
                near_one ? std::log(std::ldexp(mantissa, static_cast<int>(exponent)))
                         : std::log(mantissa) + std::numbers::ln2 * static_cast<double>(exponent);
          }
        }
      },
      metric.length);
  d["faces"] = from_matrix(faces);
  d["log_lengths"] = from_matrix(log_length);
  d["face_labels"] = from_vector(label);
}

}  // namespace

void read_metric(OptionReader& read, conformal::MetricOptions& options) {
  read("tolerance", options.tolerance);
  read("bits", options.bits);
  read("iterations", options.max_iterations);
  read("max_seconds", options.max_seconds);
  read("require_convergence", options.require_convergence);
}

void read_start_refinement(OptionReader& read, conformal::StartRefinement& refinement) {
  using conformal::StartRefinement;
  read.choice("intrinsic_refinement", refinement,
              {{"auto", StartRefinement::kAuto},
               {"on", StartRefinement::kOn},
               {"off", StartRefinement::kOff}});
}

py::object to_object(const conformal::ConformalMetric& metric) {
  py::dict d;
  add_refinement(metric, d);
  d["angle_error"] = metric.angle_error;
  d["scale_range"] = metric.scale_range;
  d["flips"] = metric.flips.size() - metric.euclidean_flips;
  d["euclidean_flips"] = metric.euclidean_flips;
  d["flip_counts"] = std::vector<std::size_t>(metric.flip_counts.begin(), metric.flip_counts.end());
  d["iterations"] = metric.iterations;
  d["bits"] = metric.bits;
  d["converged"] = metric.converged;
  d["error_history"] = from_vector(metric.error_history);
  d["symmetric"] = metric.mesh.symmetric();
  add_mesh(metric, d);
  d["stats"] = to_dict(metric.stats);
  return d;
}

void bind_conformal(py::module_& module) {
  module.def(
      "conformal_metric",
      [](const Array<double>& vertices, const Array<Index>& faces,
         const Array<double>& target_angles, const py::dict& options, const py::object& lengths,
         int threads) {
        MetricRequest request;
        request.surface = to_surface(vertices, faces);
        request.target_angles.assign(target_angles.data(),
                                     target_angles.data() + target_angles.size());
        OptionReader read(options);
        read_metric(read, request.options);
        read_start_refinement(read, request.refinement);
        read.end();
        if (!lengths.is_none())
          request.lengths = to_matrix<Points3>(lengths.cast<Array<double>>(), "lengths");
        return start_job(
            [request = std::move(request)](ExecutionContext& context) {
              return solve(request, context);
            },
            [](const conformal::ConformalMetric& metric) { return to_object(metric); }, threads);
      },
      py::arg("vertices"), py::arg("faces"), py::arg("target_angles"), py::arg("options"),
      py::arg("lengths"), py::arg("threads"));
}

}  // namespace flipfree::python
