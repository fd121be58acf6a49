// The edges of a coarse disk as they lie in the plane before its map moves it: where a fine surface
// that follows it has to bend.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "flipfree/matchmaker/continuation/decimate.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

class Creases {
 public:
  using Mesh = mesh::EditableTriangulation;

  // Where a point lies: in a face, on an edge (Mesh::edge) or at a vertex of the coarse mesh.
  struct Place {
    enum class Kind { kFace, kEdge, kVertex } kind = Kind::kFace;
    Index id = kInvalid;
  };

  // `coarse`: a map of disk.surface, refined or not, which outlives this; fine_uv: where the disk's
  // vertices lie.
  Creases(const mesh::RefinedMap& coarse, const CoarseDisk& disk, const Points2& fine_uv);

  // Rounding of added vertices may have turned a face over.
  bool valid() const { return valid_; }
  const Mesh& mesh() const { return mesh_; }
  const Vector2& before(VertexId v) const { return before_[static_cast<std::size_t>(v)]; }
  Vector2 after(VertexId v) const { return after_.row(v).transpose(); }

  // Of a point within an unrefined coarse face.
  Place locate(FaceId parent, const Vector2& p) const;
  // Where the map takes it.
  Vector2 moved(const Place& place, const Vector2& p) const;
  // How much the map enlarges areas there, at least.
  double least_stretch(const Place& place) const;
  // Do the insides of a triangle and of a coarse face meet?
  bool meets(FaceId f, const std::array<Vector2, 3>& triangle) const;

  template <typename Visit>
  void for_each_face(const Place& place, const Visit& visit) const {
    if (place.kind == Place::Kind::kFace) {
      visit(place.id);
    } else if (place.kind == Place::Kind::kEdge) {
      visit(place.id / 3);
      if (!mesh_.is_boundary(place.id)) visit(mesh_.opposite(place.id) / 3);
    } else {
      mesh_.for_each_outgoing(place.id, [&](HalfedgeId h) { visit(h / 3); });
    }
  }

 private:
  const Mesh& mesh_;
  const Points2& after_;
  std::vector<Vector2> before_;
  std::vector<std::vector<FaceId>> parts_;  // of each unrefined coarse face
  std::vector<double> stretch_;             // of areas, by face
  bool valid_ = true;
};

}  // namespace flipfree::matchmaker
