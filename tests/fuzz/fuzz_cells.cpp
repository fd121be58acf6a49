#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <vector>

#include "finding.h"
#include "flipfree/base/context.h"
#include "flipfree/base/plane.h"
#include "flipfree/quads/flat_surface.h"
#include "flipfree/quads/quads.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

using Square = std::array<VertexId, 4>;
using Side = std::pair<VertexId, VertexId>;

struct Squares {
  std::vector<Square> squares;
  Points3 points;
  std::map<Side, std::array<std::size_t, 2>> sides;  // square and place
};

// The surface of some of 2 x 2 x 3 dice, without some squares. Empty if it is no manifold.
Squares read_dice(Bytes& bytes) {
  std::set<std::array<Index, 3>> dice;
  const Index chosen = bytes.byte() + 256 * bytes.byte();
  for (Index i = 0; i < 12; ++i)
    if (((chosen >> i) & 1) != 0) dice.insert({i % 2, i / 2 % 2, i / 4});
  Squares out;
  std::map<std::array<Index, 3>, VertexId> number;
  std::vector<std::array<Index, 3>> places;
  for (const auto& die : dice) {
    for (Index axis = 0; axis < 3; ++axis) {
      for (Index end = 0; end < 2; ++end) {
        std::array<Index, 3> beside = die;
        beside[at(axis)] += 2 * end - 1;
        if (dice.contains(beside) || bytes.byte() % 16 == 1) continue;
        Square square{};
        for (Index k = 0; k < 4; ++k) {
          // Counter-clockwise from outside.
          const Index u = k == 1 || k == 2 ? 1 : 0, w = k >= 2 ? 1 : 0;
          std::array<Index, 3> place = die;
          place[at(axis)] += end;
          place[at((axis + 1) % 3)] += end == 1 ? u : w;
          place[at((axis + 2) % 3)] += end == 1 ? w : u;
          const auto [known, added] = number.emplace(place, static_cast<VertexId>(number.size()));
          if (added) places.push_back(place);
          square[at(k)] = known->second;
        }
        out.squares.push_back(square);
      }
    }
  }
  out.points.resize(static_cast<Eigen::Index>(places.size()), 3);
  for (std::size_t v = 0; v < places.size(); ++v)
    for (int k = 0; k < 3; ++k) out.points(static_cast<Eigen::Index>(v), k) = places[v][at(k)];
  for (std::size_t i = 0; i < out.squares.size(); ++i)
    for (std::size_t k = 0; k < 4; ++k)
      if (!out.sides.insert({{out.squares[i][k], out.squares[i][(k + 1) % 4]}, {i, k}}).second)
        return {};
  return out;
}

// How many squares meet at a vertex, and whether all the way round; 0 where they are no one fan.
std::pair<Index, bool> fan(const Squares& s, VertexId v) {
  Index all = 0;
  std::array<std::size_t, 2> first{};
  bool border = false;
  for (std::size_t i = 0; i < s.squares.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      if (s.squares[i][k] != v) continue;
      // Of a border's fan the one with nothing clockwise of it.
      const bool begins = !s.sides.contains({s.squares[i][(k + 1) % 4], v});
      if (all++ == 0 || (begins && !border)) first = {i, k};
      border = border || begins;
    }
  }
  Index count = 0;
  auto [i, k] = first;
  while (true) {
    ++count;
    const auto next = s.sides.find({v, s.squares[i][(k + 3) % 4]});
    if (next == s.sides.end() || next->second == first) break;
    i = next->second[0];
    k = next->second[1];
  }
  return {count == all ? count : 0, !border};
}

}  // namespace

void fuzz_cells(Bytes bytes) {
  const Squares s = read_dice(bytes);
  const auto vertices = static_cast<Index>(s.points.rows());
  std::size_t irregular = 0;
  std::vector<std::pair<Index, bool>> around;
  for (VertexId v = 0; v < vertices; ++v) {
    around.push_back(fan(s, v));
    if (around.back().first == 0) return;
    irregular += around.back().first != (around.back().second ? 4 : 2) ? 1 : 0;
  }
  if (s.squares.empty()) return;
  // So many cells are a side.
  const auto side = static_cast<double>(bytes.between(1, 3));
  certify::Parametrization map;
  map.surface.vertices = s.points;
  Triangles faces(static_cast<Eigen::Index>(2 * s.squares.size()), 3);
  Points2 uv(6 * static_cast<Eigen::Index>(s.squares.size()), 2);
  std::vector<std::array<Vector2, 4>> corner;  // per square, in its own chart
  for (std::size_t i = 0; i < s.squares.size(); ++i)
    corner.push_back({Vector2(0, 0), Vector2(side, 0), Vector2(side, side), Vector2(0, side)});
  const auto diagonals = [&](std::size_t i, bool other) {
    std::array<std::array<std::size_t, 3>, 2> halves = {{{0, 1, 2}, {0, 2, 3}}};
    if (other) halves = {{{1, 2, 3}, {1, 3, 0}}};
    bool positive = true;
    for (const auto& t : halves)
      positive = positive && twice_area(corner[i][t[0]], corner[i][t[1]], corner[i][t[2]]) > 0.0;
    return std::pair(halves, positive);
  };
  std::vector<char> other;
  for (std::size_t i = 0; i < s.squares.size(); ++i) other.push_back(bytes.flag() ? 1 : 0);
  // Flat vertices lie anywhere: each is moved, in every chart around it, as far as nothing flips.
  for (VertexId v = 0; v < vertices; ++v) {
    if (!around[at(v)].second || around[at(v)].first != 4) continue;
    const Vector2 motion(bytes.eighth() / 16.0, bytes.eighth() / 16.0);
    for (int sign = 0; sign < 2; ++sign) {  // and back, where it may not be
      std::size_t i = 0, k = 0;
      while (s.squares[i][k] != v) {
        k = (k + 1) % 4;
        i += k == 0 ? 1 : 0;
      }
      bool positive = true;
      for (Index turn = 0; turn < 4; ++turn) {
        // Its next side is the first one's, turned; and turned in its chart by its place.
        const Vector2 here =
            quads::turned(motion, static_cast<Index>(k) - turn) * (sign == 0 ? 1.0 : -1.0);
        corner[i][k] += here;
        positive = positive && diagonals(i, other[i] != 0).second;
        const auto next = s.sides.at({v, s.squares[i][(k + 3) % 4]});
        i = next[0];
        k = next[1];
      }
      if (positive) break;
    }
  }
  for (std::size_t i = 0; i < s.squares.size(); ++i) {
    const Index quarters = bytes.below(4);
    const Vector2 shift(bytes.below(7), bytes.below(7));
    const auto halves = diagonals(i, other[i] != 0).first;
    for (std::size_t half = 0; half < 2; ++half) {
      const auto f = static_cast<FaceId>(2 * i + half);
      for (int k = 0; k < 3; ++k) {
        const std::size_t c = halves[half][at(k)];
        faces(f, k) = s.squares[i][c];
        uv.row(3 * f + k) = (quads::turned(corner[i][c], quarters) + shift).transpose();
      }
    }
  }
  map.surface.faces = std::move(faces);
  map.uv32 = uv.cast<float>();
  certify::set_identity_provenance(map);
  ExecutionContext context;
  const quads::QuadMesh mesh = quads::quads_of_map(map, map.surface, {}, context);
  require(mesh.certificate.ok, "cells without a certificate");
  require(mesh.quads.size() == s.squares.size() * static_cast<std::size_t>(side * side),
          "another number of quads than cells");
  require(mesh.certificate.irregular.size() == irregular, "other irregular vertices");
}

}  // namespace flipfree::fuzz
