// Whether a triangle in space has an area at all, decided exactly; and a shape.
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// False if the three corners are exactly collinear, or two of them equal. Precondition: finite
// coordinates, valid indices.
bool has_area(const Points3& positions, const Triangles& faces, FaceId f);

// From a corner to the next and the previous one of its face.
struct CornerSides {
  Vector3 next, previous;
};
inline CornerSides sides_at(const Surface& surface, CornerId c) {
  const auto place = [&](CornerId corner) -> Vector3 {
    return surface.vertices.row(surface.faces(corner / 3, corner % 3));
  };
  return {place(next_corner(c)) - place(c), place(previous_corner(c)) - place(c)};
}

// Of all faces together, in double.
double area_of(const Surface& surface);

// Height over length below which a triangle among others has no shape that a map could keep: far
// below what 32-bit coordinates can tell.
inline constexpr double kThinnest = 1e-8;
// Share of the faces, or of the area, up to which thin ones are said to have no shape. A surface
// that is squeezed as a whole keeps its metric.
inline constexpr double kFewFaces = 0.1;
inline constexpr double kLittleArea = 1e-6;

// Faces without an area, and faces thinner than kThinnest if these are few, or hardly any of the
// surface; ascending. They get
// shapes of their own (mesh/separated/separated.h), and have no share in figures of
// distortion. Cost: O(#F).
std::vector<FaceId> shapeless_faces(const Points3& positions, const Triangles& faces);

// Pieces of very different size, each in a unit in which squares of areas neither overflow nor
// vanish.

// Binary exponents of a piece's extent up to which it stays as it is.
inline constexpr int kOrdinaryExponent = 64;

// A surface divided by a power of two near its extent, which is exact but for what vanishes beside
// it; as it is if that is within 2^-64 and 2^64. Where that leaves the range of numbers, the
// surface is moved to the origin first. The surface must outlive it. Cost: O(#F).
class InOwnUnit {
 public:
  explicit InOwnUnit(const Surface& surface);

  const Surface& surface() const { return scaled_ ? *scaled_ : given_; }
  // What lengths of surface() must be multiplied by to be those of the given one.
  double unit() const { return unit_; }

 private:
  const Surface& given_;
  std::optional<Surface> scaled_;
  double unit_ = 1.0;
};

}  // namespace flipfree::mesh
