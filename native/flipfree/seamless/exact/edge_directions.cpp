#include "flipfree/seamless/exact/edge_directions.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

namespace flipfree::seamless {
namespace {

using Pair = std::pair<VertexId, VertexId>;

std::vector<Pair> sorted(const IndexPairs& pairs) {
  std::vector<Pair> list;
  for (Eigen::Index e = 0; e < pairs.rows(); ++e)
    list.emplace_back(std::minmax(pairs(e, 0), pairs(e, 1)));
  std::sort(list.begin(), list.end());
  return list;
}

}  // namespace

void turn_along_edges(const Triangles& faces, const mesh::Adjacency& adjacency,
                      const std::vector<Index>& chart_of_face, Index charts,
                      const IndexPairs& diagonals, Points2& corner_uv) {
  const std::vector<Pair> left_out = sorted(diagonals);
  std::vector<std::complex<double>> sum(static_cast<std::size_t>(charts), 0.0);
  std::vector<char> open(sum.size(), 0);
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const auto chart = static_cast<std::size_t>(chart_of_face[static_cast<std::size_t>(f)]);
      if (adjacency.opposite[static_cast<std::size_t>(3 * f + k)] == kInvalid) open[chart] = 1;
      const Pair edge = std::minmax(faces(f, k), faces(f, next));
      if (std::binary_search(left_out.begin(), left_out.end(), edge)) continue;
      const Vector2 along = corner_uv.row(3 * f + next) - corner_uv.row(3 * f + k);
      const double length = along.norm();
      if (!(length > 0.0)) continue;
      const std::complex<double> direction(along.x() / length, along.y() / length);
      const std::complex<double> twice = direction * direction;
      sum[chart] += length * twice * twice;
    }
  }
  std::vector<std::complex<double>> turn;
  for (std::size_t i = 0; i < sum.size(); ++i)
    turn.push_back(open[i] != 0 ? 1.0 : std::polar(1.0, -0.25 * std::arg(sum[i])));
  for (Eigen::Index c = 0; c < corner_uv.rows(); ++c) {
    const auto chart = static_cast<std::size_t>(chart_of_face[static_cast<std::size_t>(c / 3)]);
    const std::complex<double> turned =
        turn[chart] * std::complex<double>(corner_uv(c, 0), corner_uv(c, 1));
    corner_uv.row(c) << turned.real(), turned.imag();
  }
}

}  // namespace flipfree::seamless
