// Conversions between numpy arrays and the solver's arrays. Shapes and types were checked by the
// Python layer.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/certify.h"
#include "flipfree/intrinsic/loops.h"

namespace flipfree::python {

template <typename T>
using Array = pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast>;

// (n, columns) array -> row-major matrix with a fixed number of columns. Throws InvalidInput if the
// shape differs.
template <typename Matrix>
Matrix to_matrix(const Array<typename Matrix::Scalar>& array, const char* name);

// What keeps `values` as long as an array shows their memory.
template <typename Values>
pybind11::capsule owner_of(std::unique_ptr<Values> values) {
  return pybind11::capsule(values.release(), [](void* kept) { delete static_cast<Values*>(kept); });
}

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

// The same of values that nobody else needs: the array takes their memory over. Of a million faces
// a copy is felt by who works in a window meanwhile.
template <typename Matrix>
pybind11::array taken_matrix(Matrix&& matrix) {
  static_assert(!std::is_reference_v<Matrix>);
  const auto rows = matrix.rows(), columns = matrix.cols();
  auto owned = std::make_unique<Matrix>(std::move(matrix));
  const auto* data = owned->data();
  return Array<typename Matrix::Scalar>({rows, columns}, data, owner_of(std::move(owned)));
}
template <typename T>
pybind11::array taken_vector(std::vector<T>&& values) {
  auto owned = std::make_unique<std::vector<T>>(std::move(values));
  const T* data = owned->data();
  const auto count = static_cast<pybind11::ssize_t>(owned->size());
  return Array<T>(count, data, owner_of(std::move(owned)));
}

// "vertex", "edge", ...
const char* kind_name(ElementKind kind);

// Plain dicts that flipfree/results.py turns into its dataclasses.
pybind11::dict to_dict(const certify::Certificate& certificate);
pybind11::dict to_dict(const Stats& stats);
pybind11::dict to_dict(certify::Parametrization&& map);

// (p,) corner ids and (p,2) targets -> pins.
std::vector<certify::CornerPin> to_corner_pins(const Array<Index>& corners,
                                               const Array<double>& uv);

// [(half-edges, quarter turns)] <-> loops; None: none.
std::optional<std::vector<intrinsic::LoopTurn>> to_loops(const pybind11::object& given);
pybind11::list from_loops(const std::vector<intrinsic::LoopTurn>& loops);

// (n,3) and (m,3) -> surface.
mesh::Surface to_surface(const Array<double>& vertices, const Array<Index>& faces);

}  // namespace flipfree::python

#include "arrays_inline.h"
