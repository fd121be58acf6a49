// What goes between Python and the solver besides what pybind11 converts itself: matrices
// (eigen.h), containers and options that may be missing (stl.h). Shapes and types were checked in
// Python.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certify.h"
#include "flipfree/conformal/map.h"
#include "flipfree/field/compute.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/quads/quads.h"

namespace flipfree::python {

// What flipfree/results.py makes its dataclasses of. Large arrays are taken out of the map: of a
// million faces a copy is felt by who works in a window meanwhile.
pybind11::object to_python(const Error& error);
pybind11::object to_python(const Stats& stats);
pybind11::object to_python(const mesh::Mend& mend);
pybind11::object to_python(const certify::Certificate& certificate);
pybind11::object to_python(certify::Parametrization&& map);
pybind11::object to_python(const conformal::ConformalMetric& metric);
pybind11::object to_python(conformal::ConformalMapResult&& result);
pybind11::object to_python(quads::QuadCertificate&& certificate);
pybind11::object to_python(quads::QuadMesh&& mesh);

}  // namespace flipfree::python

namespace pybind11::detail {

// Numbers as arrays; what nobody else needs goes to Python with its memory.
template <typename T>
struct NumbersCaster {
  PYBIND11_TYPE_CASTER(std::vector<T>, const_name("numpy.ndarray"));

  bool load(handle source, bool) {
    const auto given = array_t<T, array::c_style | array::forcecast>::ensure(source);
    if (!given) return false;
    value.assign(given.data(), given.data() + given.size());
    return true;
  }
  template <typename Values>
  static handle cast(Values&& values, return_value_policy, handle) {
    auto owned = std::make_unique<std::vector<T>>(std::forward<Values>(values));
    const T* data = owned->data();
    const auto count = static_cast<ssize_t>(owned->size());
    const capsule owner(owned.release(),
                        [](void* kept) { delete static_cast<std::vector<T>*>(kept); });
    return array_t<T>(count, data, owner).release();
  }
};
template <>
struct type_caster<std::vector<flipfree::Index>> : NumbersCaster<flipfree::Index> {};
template <>
struct type_caster<std::vector<double>> : NumbersCaster<double> {};
template <>
struct type_caster<std::vector<std::int8_t>> : NumbersCaster<std::int8_t> {};

// From (corners 3 f + k, uv).
template <>
struct type_caster<std::vector<flipfree::certify::CornerPin>> {
  PYBIND11_TYPE_CASTER(std::vector<flipfree::certify::CornerPin>, const_name("tuple"));

  bool load(handle source, bool) {
    const auto [corners, uv] =
        source.cast<std::pair<std::vector<flipfree::Index>, flipfree::Points2>>();
    for (std::size_t i = 0; i < corners.size(); ++i)
      value.push_back({corners[i], uv.row(static_cast<Eigen::Index>(i)).transpose()});
    return true;
  }
};

// (directions, rotation, quarters), each of which may be empty.
template <>
struct type_caster<flipfree::field::GivenField> {
  PYBIND11_TYPE_CASTER(flipfree::field::GivenField, const_name("tuple"));

  bool load(handle source, bool) {
    std::tie(value.directions, value.rotation, value.quarters) = source.cast<
        std::tuple<flipfree::Points3, std::vector<double>, std::vector<flipfree::Index>>>();
    return true;
  }
  static handle cast(const flipfree::field::GivenField& field, return_value_policy, handle) {
    return pybind11::make_tuple(field.directions, field.rotation, field.quarters).release();
  }
};

// (half-edges, quarter turns).
template <>
struct type_caster<flipfree::intrinsic::LoopTurn> {
  PYBIND11_TYPE_CASTER(flipfree::intrinsic::LoopTurn, const_name("tuple"));

  bool load(handle source, bool) {
    auto [loop, turns] = source.cast<std::pair<std::vector<flipfree::Index>, flipfree::Index>>();
    value = {std::move(loop), turns};
    return true;
  }
  static handle cast(const flipfree::intrinsic::LoopTurn& turn, return_value_policy, handle) {
    return pybind11::make_tuple(turn.loop, turn.quarter_turns).release();
  }
};

// What only goes to Python.
struct ResultCaster {
  static constexpr auto name = const_name("object");
  template <typename Result>
  static handle cast(Result&& result, return_value_policy, handle) {
    return flipfree::python::to_python(std::forward<Result>(result)).release();
  }
};
template <>
struct type_caster<flipfree::Stats> : ResultCaster {};
template <typename Result, typename... Results>
constexpr bool is_one_of = (std::is_same_v<Result, Results> || ...);
template <typename Result>
struct type_caster<
    Result, std::enable_if_t<is_one_of<
                Result, flipfree::Error, flipfree::mesh::Mend, flipfree::certify::Certificate,
                flipfree::certify::Parametrization, flipfree::conformal::ConformalMetric,
                flipfree::conformal::ConformalMapResult, flipfree::quads::QuadCertificate,
                flipfree::quads::QuadMesh>>> : ResultCaster {};

}  // namespace pybind11::detail
