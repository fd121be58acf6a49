// One function per stage, each in its own bind_<stage>.cpp, called by module.cpp.
#pragma once

#include <pybind11/pybind11.h>

namespace flipfree::python {

void bind_certify(pybind11::module_& module);
void bind_conformal(pybind11::module_& module);
void bind_conformal_map(pybind11::module_& module);
void bind_distortion(pybind11::module_& module);
void bind_embedding(pybind11::module_& module);
void bind_files(pybind11::module_& module);
void bind_matchmaker(pybind11::module_& module);
void bind_mesh(pybind11::module_& module);
void bind_seamless(pybind11::module_& module);
void bind_unwrap(pybind11::module_& module);

}  // namespace flipfree::python
