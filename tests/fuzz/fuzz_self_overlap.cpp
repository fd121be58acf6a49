#include <map>
#include <set>
#include <utility>
#include <vector>

#include "finding.h"
#include "flipfree/matchmaker/target/self_overlapping.h"
#include "rational.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

// The plain dynamic programme of Shor and Van Wyk: corners i .. j and the chord that closes them
// bound a disk of counter-clockwise triangles if some k between makes one with i and j.
bool fills(const std::vector<Point>& polygon) {
  const std::size_t n = polygon.size();
  std::vector<std::vector<char>> disk(n, std::vector<char>(n, 0));
  for (std::size_t i = 0; i + 1 < n; ++i) disk[i][i + 1] = 1;
  for (std::size_t length = 2; length < n; ++length) {
    for (std::size_t i = 0; i + length < n; ++i) {
      const std::size_t j = i + length;
      for (std::size_t k = i + 1; k < j && !disk[i][j]; ++k)
        disk[i][j] = disk[i][k] && disk[k][j] && side(polygon[i], polygon[k], polygon[j]) > 0;
    }
  }
  return disk[0][n - 1] != 0;
}

}  // namespace

void fuzz_self_overlap(Bytes bytes) {
  const bool coarse = bytes.flag();
  const Index wanted = bytes.between(3, 20);
  matchmaker::Polygon polygon;
  while (static_cast<Index>(polygon.size()) < wanted) {
    // Few different coordinates, so that corners meet and lie on lines; or anything.
    const Vector2 p =
        coarse ? Vector2(bytes.below(5), bytes.below(5)) : Vector2(bytes.number(), bytes.number());
    if (polygon.empty() || p != polygon.back()) {
      polygon.push_back(p);
    } else if (bytes.empty()) {
      break;
    }
  }
  while (polygon.size() > 1 && polygon.back() == polygon.front()) polygon.pop_back();
  if (polygon.size() < 3) return;
  std::vector<Point> points;
  for (const Vector2& p : polygon) points.push_back(exact(p));

  ExecutionContext context;
  const TimeLimit limit(context, 20.0);
  matchmaker::SelfOverlap result;
  require(allowed([&] { result = matchmaker::find_self_overlap(polygon, context); }),
          "find_self_overlap has thrown");
  require(result.exists == fills(points), "find_self_overlap differs from the plain programme");
  if (!result.exists) {
    require(result.triangles.rows() == 0, "triangles of no disk");
    return;
  }
  const auto n = static_cast<Index>(polygon.size());
  require(result.triangles.rows() == n - 2, "another number of triangles");
  std::map<std::pair<Index, Index>, int> edges;
  for (Eigen::Index t = 0; t < result.triangles.rows(); ++t) {
    for (Index k = 0; k < 3; ++k) {
      const Index a = result.triangles(t, k);
      require(a >= 0 && a < n, "a corner that does not exist");
      ++edges[{a, result.triangles(t, (k + 1) % 3)}];
    }
    const auto at = [&](Index k) {
      return points[static_cast<std::size_t>(result.triangles(t, k))];
    };
    require(side(at(0), at(1), at(2)) > 0, "a triangle is flipped");
  }
  // Every edge has its other half, but those of the polygon.
  for (const auto& [edge, times] : edges) {
    require(times == 1, "an edge is used twice in one direction");
    const bool outer = edge.second == (edge.first + 1) % n;
    require(outer || edges.contains({edge.second, edge.first}), "triangles do not fit together");
  }
  for (Index i = 0; i < n; ++i)
    require(edges.contains({i, (i + 1) % n}), "an edge of the polygon is missing");
}

}  // namespace flipfree::fuzz
