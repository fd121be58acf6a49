// One function per stage, each in a file of its own, called by module.cpp.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <utility>

#include "arrays.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "job.h"
#include "options.h"

namespace flipfree::python {

void bind_certify(pybind11::module_& module);
void bind_conformal(pybind11::module_& module);
void bind_conformal_map(pybind11::module_& module);
void bind_distortion(pybind11::module_& module);
void bind_embedding(pybind11::module_& module);
void bind_field(pybind11::module_& module);
void bind_files(pybind11::module_& module);
void bind_matchmaker(pybind11::module_& module);
void bind_mesh(pybind11::module_& module);
void bind_seamless(pybind11::module_& module);
void bind_unwrap(pybind11::module_& module);

// The options "engine" and "boundary" of seamless and field-aligned maps.
void read_ways(OptionReader& read, seamless::Engine& engine, seamless::Boundary& boundary);

// Runs `solve(context) -> certify::Parametrization` as a job whose result is the map's dict.
template <typename Solve>
std::unique_ptr<Job> start_map_job(Solve solve, int threads) {
  return start_job(
      std::move(solve),
      [](certify::Parametrization& map) -> pybind11::object { return to_dict(std::move(map)); },
      threads);
}

}  // namespace flipfree::python
