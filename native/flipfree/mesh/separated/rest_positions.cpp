#include "flipfree/mesh/separated/rest_positions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "flipfree/mesh/face_area.h"

namespace flipfree::mesh {
namespace {

// Scrambled bits of a number (the finaliser of splitmix64, Steele et al. 2014).
std::uint64_t scrambled(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// Each coordinate between -1 and 1, but not within a quarter of zero, so that none is lost.
Vector3 direction_of(VertexId v, std::uint64_t round) {
  Vector3 direction;
  for (Index k = 0; k < 3; ++k) {
    const std::uint64_t bits = scrambled(3 * (static_cast<std::uint64_t>(v) + (round << 32)) +
                                         static_cast<std::uint64_t>(k));
    const double share = static_cast<double>(bits >> 12) * 0x1p-52;
    direction[k] = (bits & 1) != 0 ? 0.25 + 0.75 * share : -0.25 - 0.75 * share;
  }
  return direction;
}

struct MeanLength {
  double sum = 0.0;
  Index count = 0;
  void add(double length) {
    if (!(length > 0.0) || !std::isfinite(length)) return;
    sum += length;
    ++count;
  }
  double mean() const { return count == 0 ? 0.0 : sum / count; }
};

// Over the longest edge. Precondition: the face has a shape.
double height_of(const Surface& surface, FaceId f) {
  const Vector3 p = surface.vertices.row(surface.faces(f, 0));
  Vector3 a = surface.vertices.row(surface.faces(f, 1)).transpose() - p;
  Vector3 b = surface.vertices.row(surface.faces(f, 2)).transpose() - p;
  const double longest = std::max({a.stableNorm(), b.stableNorm(), (b - a).stableNorm()});
  a /= longest;  // a product of lengths may be no number
  b /= longest;
  return a.cross(b).norm() * longest;
}

// Per vertex, of the faces with a shape; infinite where there is none.
std::vector<double> least_heights(const Surface& surface, const std::vector<FaceId>& shapeless) {
  std::vector<double> least(at(static_cast<Index>(surface.vertices.rows())),
                            std::numeric_limits<double>::infinity());
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (std::binary_search(shapeless.begin(), shapeless.end(), f)) continue;
    const double height = height_of(surface, f);
    for (Index k = 0; k < 3; ++k)
      least[at(surface.faces(f, k))] = std::min(least[at(surface.faces(f, k))], height);
  }
  return least;
}

// By how much a vertex is moved in the first round.
double shift_of(double length, double least_height) {
  return std::clamp(kRestShiftOfHeight * least_height, kLeastRestShift * length,
                    kRestShift * length);
}

}  // namespace

Points3 rest_positions(const Surface& surface) {
  std::vector<FaceId> flat = shapeless_faces(surface.vertices, surface.faces);
  Points3 result = surface.vertices;
  if (flat.empty()) return result;
  std::vector<char> moves(at(static_cast<Index>(surface.vertices.rows())), 0);
  for (const FaceId f : flat) {
    for (Index k = 0; k < 3; ++k) moves[at(surface.faces(f, k))] = 1;
  }
  std::vector<MeanLength> around(moves.size());
  MeanLength all;
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
    const VertexId a = surface.faces(c / 3, c % 3);
    const CornerId n = next_corner(c);
    const VertexId b = surface.faces(n / 3, n % 3);
    const double length = (surface.vertices.row(b) - surface.vertices.row(a)).stableNorm();
    around[at(a)].add(length);
    around[at(b)].add(length);
    all.add(length);
  }
  const std::vector<double> height = least_heights(surface, flat);
  // The second round is for corners that share a direction by chance, or shifts that are lost
  // beside large coordinates.
  constexpr std::uint64_t kRounds = 8;
  for (std::uint64_t round = 0; round < kRounds && !flat.empty(); ++round) {
    for (std::size_t v = 0; v < moves.size(); ++v) {
      if (moves[v] == 0) continue;
      double length = around[v].count > 0 ? around[v].mean() : all.mean();
      if (!(length > 0.0)) length = 1.0 / kRestShift;
      const auto row = static_cast<VertexId>(v);
      const double magnitude = surface.vertices.row(row).cwiseAbs().maxCoeff();
      const double shift =
          std::max(std::ldexp(shift_of(length, height[v]), 2 * static_cast<int>(round)),
                   0x1p-40 * magnitude);
      result.row(row) = surface.vertices.row(row) + shift * direction_of(row, round).transpose();
    }
    flat = shapeless_faces(result, surface.faces);
    moves.assign(moves.size(), 0);
    for (const FaceId f : flat) {
      for (Index k = 0; k < 3; ++k) moves[at(surface.faces(f, k))] = 1;
    }
  }
  return result;
}

}  // namespace flipfree::mesh
