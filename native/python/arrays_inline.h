#pragma once

#include <string>

#include "flipfree/base/error.h"

namespace flipfree::python {

template <typename Matrix>
Matrix to_matrix(const Array<typename Matrix::Scalar>& array, const char* name) {
  constexpr auto kColumns = Matrix::ColsAtCompileTime;
  if (array.ndim() != 2 || array.shape(1) != kColumns) {
    throw_invalid(ErrorCode::kBadShape,
                  std::string(name) + " must have shape (n, " + std::to_string(kColumns) + ").");
  }
  Matrix matrix(array.shape(0), kColumns);
  std::copy(array.data(), array.data() + array.size(), matrix.data());
  return matrix;
}

}  // namespace flipfree::python
