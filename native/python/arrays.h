// Conversions between numpy arrays and the solver's arrays. Shapes and types were checked by the
// Python layer.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/certify.h"
#include "flipfree/intrinsic/loops/dual_loops.h"

namespace flipfree::python {

template <typename T>
using Array = pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast>;

// (n, columns) array -> row-major matrix with a fixed number of columns. Throws InvalidInput if the
// shape differs.
template <typename Matrix>
Matrix to_matrix(const Array<typename Matrix::Scalar>& array, const char* name);

// Matrix -> (rows, columns) array; vector -> (n,) array.
template <typename Derived>
pybind11::array from_matrix(const Eigen::PlainObjectBase<Derived>& matrix) {
  Array<typename Derived::Scalar> array({matrix.rows(), matrix.cols()});
  std::copy(matrix.data(), matrix.data() + matrix.size(), array.mutable_data());
  return array;
}
template <typename T>
pybind11::array from_vector(const std::vector<T>& values) {
  Array<T> array(static_cast<pybind11::ssize_t>(values.size()));
  std::copy(values.begin(), values.end(), array.mutable_data());
  return array;
}

// "vertex", "edge", ...
const char* kind_name(ElementKind kind);

// Plain dicts that flipfree/results.py turns into its dataclasses.
pybind11::dict to_dict(const certify::Certificate& certificate);
pybind11::dict to_dict(const Stats& stats);
pybind11::dict to_dict(const certify::Parametrization& map);

// (p,) corner ids and (p,2) targets -> pins.
std::vector<certify::CornerPin> to_corner_pins(const Array<Index>& corners,
                                               const Array<double>& uv);

// [(half-edges, quarter turns)] <-> loops; None: none.
std::optional<std::vector<intrinsic::LoopTurn>> to_loops(const pybind11::object& given);
pybind11::list from_loops(const std::vector<intrinsic::LoopTurn>& loops);

// Setters of a bound option struct's array members: from an array of the shape of a matrix, or of
// ids.
template <typename Options, typename Matrix>
auto matrix_setter(Matrix Options::*member, const char* name) {
  return [member, name](Options& options, const Array<typename Matrix::Scalar>& array) {
    options.*member = to_matrix<Matrix>(array, name);
  };
}
template <typename Options>
auto ids_setter(std::vector<Index> Options::*member) {
  return [member](Options& options, const Array<Index>& ids) {
    (options.*member).assign(ids.data(), ids.data() + ids.size());
  };
}

// Setter of pins, from (corners, uv).
template <typename Options>
auto pins_setter(std::vector<certify::CornerPin> Options::*member) {
  return [member](Options& options, const std::pair<Array<Index>, Array<double>>& pins) {
    options.*member = to_corner_pins(pins.first, pins.second);
  };
}

// (n,3) and (m,3) -> surface.
mesh::Surface to_surface(const Array<double>& vertices, const Array<Index>& faces);

}  // namespace flipfree::python

#include "arrays_inline.h"
