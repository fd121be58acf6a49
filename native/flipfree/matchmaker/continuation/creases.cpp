#include "flipfree/matchmaker/continuation/creases.h"

#include <algorithm>
#include <limits>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// Is the second triangle beyond a side of the first?
bool separated(const std::array<Vector2, 3>& a, const std::array<Vector2, 3>& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    bool beyond = true;
    for (const Vector2& p : b)
      beyond = beyond && numeric::orientation(a[k], a[(k + 1) % 3], p) <= 0;
    if (beyond) return true;
  }
  return false;
}

}  // namespace

Creases::Creases(const mesh::RefinedMap& coarse, const CoarseDisk& disk, const Points2& fine_uv)
    : mesh_(coarse.surface.mesh), after_(coarse.uv) {
  before_.resize(coarse.surface.position.size(), Vector2::Zero());
  for (std::size_t v = 0; v < before_.size(); ++v) {
    const mesh::Support& s = coarse.surface.support[v];
    const auto at = [&](std::size_t i) -> Vector2 {
      return fine_uv.row(disk.fine[static_cast<std::size_t>(s.vertex[i])]).transpose();
    };
    if (v < disk.fine.size()) {
      before_[v] = fine_uv.row(disk.fine[v]).transpose();
      continue;
    }
    for (std::size_t i = 0; i < 3 && s.vertex[i] != kInvalid; ++i)
      before_[v] += s.weight[i] * at(i);
  }
  parts_.resize(static_cast<std::size_t>(disk.surface.faces.rows()));
  stretch_.assign(static_cast<std::size_t>(mesh_.face_slots()), 0.0);
  for (FaceId f = 0; f < mesh_.face_slots(); ++f) {
    if (!mesh_.alive(f)) continue;
    parts_[static_cast<std::size_t>(mesh_.parent(f))].push_back(f);
    const Mesh::Triangle c = mesh_.corners(f);
    valid_ = valid_ && numeric::orientation(before(c[0]), before(c[1]), before(c[2])) > 0;
    stretch_[static_cast<std::size_t>(f)] = twice_area(after(c[0]), after(c[1]), after(c[2])) /
                                            twice_area(before(c[0]), before(c[1]), before(c[2]));
  }
}

Creases::Place Creases::locate(FaceId parent, const Vector2& p) const {
  FaceId nearest = kInvalid;
  double most = 0;
  for (const FaceId f : parts_[static_cast<std::size_t>(parent)]) {
    const Mesh::Triangle c = mesh_.corners(f);
    std::array<int, 3> side{};  // of the edge from corner k
    double least = 1;
    const double whole = twice_area(before(c[0]), before(c[1]), before(c[2]));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2& a = before(c[k]);
      const Vector2& b = before(c[(k + 1) % 3]);
      side[k] = numeric::orientation(a, b, p);
      least = std::min(least, twice_area(a, b, p) / whole);
    }
    const auto zeros = std::count(side.begin(), side.end(), 0);
    if (*std::min_element(side.begin(), side.end()) >= 0) {
      if (zeros == 0) return {Place::Kind::kFace, f};
      for (std::size_t k = 0; k < 3; ++k) {
        if (zeros == 1 && side[k] == 0)
          return {Place::Kind::kEdge, mesh_.edge(3 * f + static_cast<Index>(k))};
        if (zeros == 2 && side[k] != 0) return {Place::Kind::kVertex, c[(k + 2) % 3]};
      }
    }
    if (nearest == kInvalid || least > most) {
      nearest = f;
      most = least;
    }
  }
  return {Place::Kind::kFace, nearest};  // between parts that rounding has moved apart
}

Vector2 Creases::moved(const Place& place, const Vector2& p) const {
  if (place.kind == Place::Kind::kVertex) return after(place.id);
  if (place.kind == Place::Kind::kEdge) {
    const VertexId a = mesh_.source(place.id);
    const VertexId b = mesh_.target(place.id);
    const Vector2 along = before(b) - before(a);
    const double t = along.dot(p - before(a)) / along.squaredNorm();
    return after(a) + t * (after(b) - after(a));
  }
  const Mesh::Triangle c = mesh_.corners(place.id);
  const double whole = twice_area(before(c[0]), before(c[1]), before(c[2]));
  const double s = twice_area(before(c[0]), p, before(c[2])) / whole;
  const double t = twice_area(before(c[0]), before(c[1]), p) / whole;
  return after(c[0]) + s * (after(c[1]) - after(c[0])) + t * (after(c[2]) - after(c[0]));
}

double Creases::least_stretch(const Place& place) const {
  double least = std::numeric_limits<double>::infinity();
  for_each_face(place,
                [&](FaceId f) { least = std::min(least, stretch_[static_cast<std::size_t>(f)]); });
  return least;
}

bool Creases::meets(FaceId f, const std::array<Vector2, 3>& triangle) const {
  const Mesh::Triangle c = mesh_.corners(f);
  const std::array<Vector2, 3> face = {before(c[0]), before(c[1]), before(c[2])};
  return !separated(face, triangle) && !separated(triangle, face);
}

}  // namespace flipfree::matchmaker
