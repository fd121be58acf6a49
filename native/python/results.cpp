// What the solver's results are in Python: dictionaries and tuples.
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bindings.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::python {

using namespace pybind11::literals;

namespace {

// "vertex", "edge", ...
const char* kind_name(ElementKind kind) {
  constexpr std::array kNames = {"none", "vertex", "edge", "face", "corner"};
  return kNames.at(static_cast<std::size_t>(kind));
}

// (quarter turns, translations).
template <typename Transitions>
py::tuple transitions_of(const Transitions& transitions) {
  std::vector<Index> turns;
  Points2 translations(static_cast<Eigen::Index>(transitions.size()), 2);
  for (const auto& t : transitions) {
    translations.row(static_cast<Eigen::Index>(turns.size())) = t.translation.transpose();
    turns.push_back(t.quarter_turns);
  }
  return py::make_tuple(std::move(turns), std::move(translations));
}

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

std::pair<std::vector<FaceId>, Points3> places_of(const std::vector<mesh::SurfacePoint>& points) {
  std::vector<FaceId> parents;
  Points3 weights(static_cast<Eigen::Index>(points.size()), 3);
  for (const mesh::SurfacePoint& point : points) {
    weights.row(static_cast<Eigen::Index>(parents.size())) = point.weight.transpose();
    parents.push_back(point.face);
  }
  return {std::move(parents), std::move(weights)};
}

py::object to_python(const Error& error) {
  py::dict witness;
  if (!error.witness.rule.empty()) witness["rule"] = error.witness.rule;
  for (const auto& [key, numbers] : error.witness.numbers) {
    witness[py::str(key)] = py::list(py::cast(numbers));
  }
  return py::dict("message"_a = rendered(error.message), "code"_a = describe(error.code),
                  "kind"_a = kind_name(error.kind), "elements"_a = error.elements,
                  "witness"_a = witness);
}

py::object to_python(const Stats& stats) {
  py::dict d;
  for (const auto& [name, value] : stats) {
    if (const auto* text = std::get_if<std::string>(&value)) {
      d[py::str(name)] = rendered(*text);
    } else {
      std::visit([&, &key = name](const auto& v) { d[py::str(key)] = py::cast(v); }, value);
    }
  }
  return d;
}

py::object to_python(const mesh::Mend& mend) {
  return py::make_tuple(describe(mend.kind), kind_name(mend.element), mend.count, mend.elements);
}

py::object to_python(const certify::Certificate& c) {
  DictWriter give;
  FLIPFREE_EACH(give, c, ok, triangles, flips64, flips32, mirrored_islands, mirrored_faces,
                winding_failures, pin_failures, seam_failures, seam_edges, seams_exact64,
                seams_exact32, seam_deviation, quarter_cones, cone_failures, holonomy_failures,
                feature_edges, features_missed, provenance_failures, overlaps, island_overlaps,
                island_overlap_faces, energy, max_energy, energy_p99, mends, failed_faces)
  IndexPairs ends(static_cast<Eigen::Index>(c.seams.size()), 2);
  for (std::size_t i = 0; i < c.seams.size(); ++i) {
    ends.row(static_cast<Eigen::Index>(i)) << c.seams[i].from, c.seams[i].to;
  }
  give.found["seam_vertices"] = std::move(ends);
  give.found["seam_transitions"] = transitions_of(c.seams);
  py::list failures;
  for (const std::string& failure : c.failures) failures.append(rendered(failure));
  give.found["failures"] = failures;
  return give.found;
}

py::object to_python(certify::Parametrization&& map) {
  const auto corners = [](auto&& values) {
    return py::object(py::cast(std::move(values)).attr("reshape")(-1, 3, 2));
  };
  DictWriter give;
  FLIPFREE_EACH(give, map, parent_face, vertex_parent, vertex_barycentric, cut_edges, certificate,
                stats)
  FLIPFREE_EACH(give, map.surface, vertices)
  give.found["faces"] = map.surface.faces.triangles();
  give.found["transitions"] = transitions_of(map.transitions);
  const bool agreed = map.agreed.rows() == map.uv.rows();
  give.found["uv64"] = corners(std::move(map.uv));
  give.found["uv"] = agreed ? corners(std::move(map.agreed)) : give.found["uv64"];
  give.found["_uv32"] = corners(std::move(map.uv32));
  return give.found;
}

// What flipfree/results.py makes its ConformalMetric of.
py::object to_python(const conformal::ConformalMetric& metric) {
  const auto own = static_cast<std::ptrdiff_t>(metric.scale_factors.size() - metric.added.size());
  const auto begin = metric.scale_factors.begin();
  DictWriter give;
  FLIPFREE_EACH(give, metric, angle_error, scale_range, euclidean_flips, iterations, bits,
                converged, error_history, stats)
  py::dict& d = give.found;
  d["scale_factors"] = std::vector<double>(begin, begin + own);
  d["added_scale_factors"] = std::vector<double>(begin + own, metric.scale_factors.end());
  d["angles"] = std::vector<double>(metric.angles.begin(), metric.angles.begin() + own);
  auto [parents, weights] = places_of(metric.added);
  d["added_parent"] = std::move(parents);
  d["added_barycentric"] = std::move(weights);
  d["flips"] = metric.flips.size() - metric.euclidean_flips;
  d["flip_counts"] = py::tuple(py::cast(metric.flip_counts));
  d["symmetric"] = metric.mesh.symmetric();
  add_triangulation(metric, d);
  return d;
}

// {map, log_weight, figures, error, metric}: error is None or what flipfree.errors take, with the
// metric; the map is valid only without one.
py::object to_python(conformal::ConformalMapResult&& result) {
  const conformal::ConformalMetric& metric = result.metric;
  const bool failed = result.failure.has_value();
  DictWriter figures;
  FLIPFREE_EACH(figures, metric, angle_error, scale_range)
  figures.found["flips"] = metric.flips.size();
  FLIPFREE_EACH(figures, metric, iterations, bits)
  return py::dict("map"_a = std::move(result.map), "log_weight"_a = std::move(result.log_weight),
                  "error"_a = result.failure, "figures"_a = figures.found,
                  "metric"_a = failed ? to_python(metric) : py::none());
}

py::object to_python(quads::QuadCertificate&& c) {
  DictWriter give;
  FLIPFREE_EACH(give, c, ok, vertices, quads, components, genus, borders, irregular, valence,
                edge_loops, turned, to_surface, to_quads, failures)
  return give.found;
}

py::object to_python(quads::QuadMesh&& mesh) {
  DictWriter give;
  FLIPFREE_EACH(give, mesh, vertices, parent_face, barycentric, quad_parent, map, stats,
                certificate)
  std::vector<Index> corners;
  for (const quads::Quad& quad : mesh.quads)
    corners.insert(corners.end(), quad.begin(), quad.end());
  give.found["quads"] = py::cast(std::move(corners)).attr("reshape")(-1, 4);
  return give.found;
}

}  // namespace flipfree::python
