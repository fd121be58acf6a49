// Parts of a surface as they are made: how they bend, what of them is flat, and their bevels.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// Radians between the normals of two faces: up to the first they are one flat face, up to the
// second one smooth region, up to the third a bend that a net runs over like a smooth one (of
// bevels with one or two segments).
inline constexpr double kFlatAngle = 0.017;
inline constexpr double kSmoothAngle = 0.44;
inline constexpr double kBendAngle = 0.61;
// Share of the area of what is no island of its own.
inline constexpr double kSliver = 0.002;

struct Hinge {
  HalfedgeId h = kInvalid;  // the lower one of the edge's two
  double length = 0.0;
  double weight = 1.0;  // times the length: what joining it is worth, as the caller says
  double angle = 0.0;   // where a flat face has bevels, from it to what is beyond them
};

using Corners = std::array<Vector2, 3>;

// A connected part of the surface: what is measured of it.
struct MadePart {
  std::vector<FaceId> faces;
  std::vector<Hinge> hinges;       // edges that may become seams
  std::vector<HalfedgeId> joined;  // edges that may not
  double area = 0.0;
  double extent = 0.0;  // the longest edge, or size() if that is longer
  bool bevelled = false;
  double size() const { return std::sqrt(area); }
};

// What all parts share.
struct Shapes {
  Shapes(const mesh::Surface& whole, const mesh::EdgeFlags& given);

  const mesh::Surface& surface;
  const Triangles& faces;
  const mesh::Adjacency& adjacency;
  const mesh::EdgeFlags& seams;
  double size = 0.0;          // root of the whole area
  std::vector<double> area;   // per face
  std::vector<Corners> flat;  // per face, laid into the plane
  // Per vertex: the size of its angle defect over the number of its corners, 0 at borders and
  // seams; and the largest angle between faces at an edge there.
  std::vector<double> curvature;
  std::vector<double> bend;
  std::vector<Index> place;  // per face: its number among its part's
  // Per face: itself, or beside it one that is no needle, of its polygon if there is: how it bends.
  std::vector<FaceId> shaped;
  std::vector<double> soft;  // per face: how deep others may lie in it; bevels
};

// The connected parts between seams. Edges of infinite `cost` (per half-edge) are none of their
// hinges.
std::vector<MadePart> parts_of(const std::vector<double>& cost, Shapes& shapes);

// Faces joined across edges that bend by less than an angle, or are no seams.
class Regions {
 public:
  Regions(const Shapes& shapes, const MadePart& part, double angle)
      : shapes_(shapes),
        sets_(static_cast<Index>(part.faces.size())),
        area_(part.faces.size(), 0.0),
        curvature_(part.faces.size(), 0.0) {
    const auto join = [&](HalfedgeId h) {
      sets_.join(shapes.place[at(h / 3)], shapes.place[at(shapes.adjacency.opposite[at(h)] / 3)]);
    };
    for (const HalfedgeId h : part.joined) join(h);
    for (const Hinge& hinge : part.hinges) {
      if (hinge.angle < angle) join(hinge.h);
    }
    for (const FaceId f : part.faces) {
      area_[at(of(f))] += shapes.area[at(f)];
      for (Index k = 0; k < 3; ++k) {
        const std::size_t v = at(shapes.faces(f, k));
        if (shapes.bend[v] < angle) curvature_[at(of(f))] += shapes.curvature[v];
      }
    }
  }

  Index of(FaceId f) { return sets_.find(shapes_.place[at(f)]); }
  double area(Index region) const { return area_[at(region)]; }
  // Sum of the sizes of angle defects at the vertices inside, at which no edge bends more.
  double curvature(Index region) const { return curvature_[at(region)]; }

 private:
  const Shapes& shapes_;
  DisjointSets sets_;  // of the part's faces
  std::vector<double> area_;
  std::vector<double> curvature_;
};

// What share of a part is flat, in regions that count; nothing where that and what is rolled is too
// little for a hard surface.
std::optional<double> flat_if_hard(const Shapes& shapes, const MadePart& part);

// Lets others lie in a face of a bevel.
void soften(Shapes& shapes, FaceId f);

// Edges inside what flat faces have of the bevels around them, of which larger ones have all. First
// those along which they grew. Hinges between them get the angle from flat face to flat face; faces
// become soft.
std::vector<HalfedgeId> bevels_of(Shapes& shapes, MadePart& part);

}  // namespace flipfree::unwrap
