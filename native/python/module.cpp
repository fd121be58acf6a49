// The compiled module flipfree._native: thin, boring, no logic. One bind_*.cpp per stage.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <new>

#include "arrays.h"
#include "bind/bindings.h"
#include "flipfree/base/error.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "job.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

// Raises flipfree.errors.<name>(message, code=..., kind=..., elements=[...]).
void raise(const char* name, const Error& error, const py::object& certificate = py::none()) {
  const py::object type = py::module_::import("flipfree.errors").attr(name);
  py::dict witness;
  if (!error.witness.rule.empty()) witness["rule"] = error.witness.rule;
  for (const auto& [key, numbers] : error.witness.numbers) witness[py::str(key)] = numbers;
  const py::object instance =
      type(error.message, py::arg("code") = std::string(describe(error.code)),
           py::arg("kind") = kind_name(error.kind), py::arg("elements") = error.elements,
           py::arg("certificate") = certificate, py::arg("witness") = witness);
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
    const py::object make = py::module_::import("flipfree.conversions").attr("certificate_from");
    raise("NotConverged", e.error(), make(to_dict(e.certificate())));
  } catch (const NotConverged& e) {
    raise("NotConverged", e.error());
  } catch (const Cancelled& e) {
    raise("Cancelled", e.error());
  } catch (const Exception& e) {
    raise("NotConverged", e.error());
  }
}

}  // namespace
}  // namespace flipfree::python

PYBIND11_MODULE(_native, module) {
  using namespace flipfree::python;
  module.doc() = "Compiled solver of Flipfree UV; use the package `flipfree`, not this module.";
  module.attr("version") = FLIPFREE_VERSION;
  py::register_exception_translator(&flipfree::python::translate);
  py::class_<flipfree::python::Job>(module, "Job")
      .def("wait", &flipfree::python::Job::wait, py::arg("seconds"))
      .def("cancel", &flipfree::python::Job::cancel)
      .def("accept", &flipfree::python::Job::accept)
      .def("progress", &flipfree::python::Job::progress)
      .def("result", &flipfree::python::Job::result);
  flipfree::python::bind_certify(module);
  flipfree::python::bind_conformal(module);
  flipfree::python::bind_conformal_map(module);
  flipfree::python::bind_distortion(module);
  flipfree::python::bind_embedding(module);
  flipfree::python::bind_field(module);
  flipfree::python::bind_files(module);
  flipfree::python::bind_matchmaker(module);
  flipfree::python::bind_mesh(module);
  flipfree::python::bind_seamless(module);
  flipfree::python::bind_unwrap(module);
}
