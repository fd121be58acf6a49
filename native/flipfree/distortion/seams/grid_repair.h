// Opens triangles that rounding has folded, by moving free positions on the integer grid.
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/seams/eliminate/constraints.h"

namespace flipfree::distortion {

// Integer coordinates, at most 2^23 in size, so that the whole map spans at most 2^24 and floats
// hold it wherever it is moved on its grid. Twice areas are sums that 64 bits hold.
using GridPoints = Eigen::Matrix<std::int64_t, Eigen::Dynamic, 2, Eigen::RowMajor>;

inline constexpr std::int64_t kLargestGridNumber = std::int64_t{1} << 23;

// Twice the signed area, exact.
std::int64_t twice_grid_area(const Triangles& faces, const GridPoints& points, FaceId f);

// Exact: the faces that are not positively oriented, ascending.
std::vector<FaceId> folded_faces(const Triangles& faces, const GridPoints& points,
                                 const ExecutionContext& context);

class GridRepair {
 public:
  // `points`: of all vertices, meeting the constraints; they go on to. Translations do not change.
  GridRepair(const SeamConstraints& constraints, const Triangles& faces, GridPoints& points,
             const ExecutionContext& context);

  // Moves positions around the folded faces, as little as it takes, so that the triangles around
  // each get a height of one grid step; of more from round to round, so that crowds spread. Returns
  // the faces still folded.
  std::vector<FaceId> sweep(std::vector<FaceId> folded);

  // Vertices that share a face with the region, and all their copies; ascending.
  std::vector<VertexId> grow(const std::vector<VertexId>& region) const;

 private:
  struct Copy {
    VertexId vertex;
    Index turns;  // it moves by i^turns times what the node moves by
  };
  bool improve(Index node);
  double score(Index node) const;
  void shift(Index node, std::int64_t x, std::int64_t y);
  bool within(Index node) const;
  std::vector<Index> nodes_of_faces(const std::vector<FaceId>& chosen) const;
  std::vector<Index> grown(const std::vector<Index>& nodes) const;

  const std::vector<char>& real_;  // per node: moves along its first axis only
  const Triangles& faces_;
  GridPoints& points_;
  const ExecutionContext& context_;
  std::vector<Index> node_of_;     // #V: its position node, kInvalid for cones
  std::vector<Index> copy_begin_;  // position node -> range in copies_
  std::vector<Copy> copies_;
  std::vector<Index> corner_begin_;  // #V + 1
  std::vector<CornerId> corners_;
  double enough_ = 1;  // height, in steps, beyond which nothing is gained
};

}  // namespace flipfree::distortion
