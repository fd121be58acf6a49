// The compiled module flipfree._native: thin, boring, no logic.
#include <array>

#include "casters.h"
#include "flipfree/base/error.h"
#include "flipfree/certify/certified_map.h"
#include "job.h"

namespace flipfree::python {

using namespace pybind11::literals;

namespace {

// "vertex", "edge", ...
const char* kind_name(ElementKind kind) {
  constexpr std::array kNames = {"none", "vertex", "edge", "face", "corner"};
  return kNames.at(static_cast<std::size_t>(kind));
}

// Raises flipfree.errors.<name>.
void raise(const char* name, const Error& error, const py::object& certificate = py::none()) {
  const py::object type = py::module_::import("flipfree.errors").attr(name);
  const py::object instance = type("certificate"_a = certificate, **to_python(error));
  PyErr_SetObject(type.ptr(), instance.ptr());
}

void translate(std::exception_ptr failure) {
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const InvalidInput& e) {
    raise("InvalidInput", e.error());
  } catch (const Infeasible& e) {
    raise("Infeasible", e.error());
  } catch (const certify::CertificateFailed& e) {
    const py::object make = py::module_::import("flipfree.results").attr("certificate_from");
    raise("NotConverged", e.error(), make(to_python(e.certificate())));
  } catch (const Cancelled& e) {
    raise("Cancelled", e.error());
  } catch (const Exception& e) {
    raise("NotConverged", e.error());
  }
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

}  // namespace

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
  IndexPairs ends(static_cast<Eigen::Index>(c.seams.size()), 2);
  for (std::size_t i = 0; i < c.seams.size(); ++i) {
    ends.row(static_cast<Eigen::Index>(i)) << c.seams[i].from, c.seams[i].to;
  }
  std::vector<std::string> failures;
  for (const std::string& failure : c.failures) failures.push_back(rendered(failure));
  return py::dict(
      "ok"_a = c.ok, "triangles"_a = c.triangles, "flips64"_a = c.flips64, "flips32"_a = c.flips32,
      "mirrored_islands"_a = c.mirrored_islands, "mirrored_faces"_a = c.mirrored_faces,
      "winding_failures"_a = c.winding_failures, "pin_failures"_a = c.pin_failures,
      "seam_failures"_a = c.seam_failures, "seam_edges"_a = c.seam_edges,
      "seams_exact64"_a = c.seams_exact64, "seams_exact32"_a = c.seams_exact32,
      "seam_deviation"_a = c.seam_deviation, "seam_vertices"_a = std::move(ends),
      "seam_transitions"_a = transitions_of(c.seams), "quarter_cones"_a = c.quarter_cones,
      "cone_failures"_a = c.cone_failures, "holonomy_failures"_a = c.holonomy_failures,
      "feature_edges"_a = c.feature_edges, "features_missed"_a = c.features_missed,
      "provenance_failures"_a = c.provenance_failures, "overlaps"_a = c.overlaps,
      "island_overlaps"_a = c.island_overlaps, "island_overlap_faces"_a = c.island_overlap_faces,
      "energy"_a = c.energy, "max_energy"_a = c.max_energy, "energy_p99"_a = c.energy_p99,
      "mends"_a = c.mends, "failures"_a = std::move(failures), "failed_faces"_a = c.failed_faces);
}

py::object to_python(certify::Parametrization&& map) {
  const auto corners = [](auto&& values) {
    return py::object(py::cast(std::move(values)).attr("reshape")(-1, 3, 2));
  };
  const bool agreed = map.agreed.rows() == map.uv.rows();
  const py::object uv64 = corners(std::move(map.uv));
  return py::dict(
      "vertices"_a = std::move(map.surface.vertices), "faces"_a = map.surface.faces.triangles(),
      "uv64"_a = uv64, "uv"_a = agreed ? corners(std::move(map.agreed)) : uv64,
      "_uv32"_a = corners(std::move(map.uv32)), "parent_face"_a = std::move(map.parent_face),
      "vertex_parent"_a = std::move(map.vertex_parent),
      "vertex_barycentric"_a = std::move(map.vertex_barycentric),
      "cut_edges"_a = std::move(map.cut_edges), "transitions"_a = transitions_of(map.transitions),
      "certificate"_a = map.certificate, "stats"_a = map.stats);
}

}  // namespace flipfree::python

PYBIND11_MODULE(_native, module) {
  using namespace flipfree::python;
  module.doc() = "Compiled solver of Flipfree UV; use the package `flipfree`, not this module.";
  module.attr("version") = FLIPFREE_VERSION;
  py::register_exception_translator(&translate);
  py::class_<Job>(module, "Job")
      .def("wait", &Job::wait)
      .def("cancel", &Job::cancel)
      .def("accept", &Job::accept)
      .def("progress", &Job::progress)
      .def("result", &Job::result);
  bind_conformal(module);
  bind_maps(module);
  bind_meshes(module);
  bind_quads(module);
  bind_seamless(module);
}
