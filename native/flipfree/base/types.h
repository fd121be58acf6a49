// Index aliases and the array types that stages hand each other. Shapes are written `#V x 3`: one
// row per vertex.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace flipfree {

// Every index is 32 bits: Blender's own limit, and half the memory traffic of 64. Aliases say what
// is counted.
using Index = std::int32_t;
using VertexId = Index;
using EdgeId = Index;
using FaceId = Index;
using HalfedgeId = Index;  // 3 f + k: from corner k of face f to corner k + 1
using CornerId = Index;    // 3 f + k: corner k of face f
using ChartId = Index;
inline constexpr Index kInvalid = -1;

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

// Row-major, so that a numpy array of the same shape is the same memory.
using Points2 = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
using Points3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Points2f = Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor>;
using Triangles = Eigen::Matrix<Index, Eigen::Dynamic, 3, Eigen::RowMajor>;
using IndexPairs = Eigen::Matrix<Index, Eigen::Dynamic, 2, Eigen::RowMajor>;

// An index or a count, as containers of the standard library take it. Precondition: not negative.
constexpr std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

// Ascending, each value once.
template <typename T>
void sort_unique(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

// Successor and predecessor of corner k within its triangle.
constexpr Index next_corner(Index corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
constexpr Index previous_corner(Index corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

}  // namespace flipfree
