// Which connected parts of a surface have an aligned boundary, and what that takes.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/seams/eliminate/cut_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// A connected part of a surface.
struct SurfacePart {
  mesh::Surface surface;
  std::vector<FaceId> faces;       // of the whole
  std::vector<VertexId> vertices;  // of the whole, per vertex of the part
  std::vector<Index> cones;
  bool bordered = false;
  bool corners_given = false;  // are there angles at its boundary?
};

// In the order of their smallest face. `cones`: kNotGiven where nothing is given.
std::vector<SurfacePart> parts_with_boundaries(const mesh::Surface& surface,
                                               const mesh::Adjacency& adjacency,
                                               const std::vector<Index>& cones);

// aligned_cones() of every part (errors: there), but for those that `freed` names: there nothing is
// given at the boundary, as at first.
std::vector<Index> with_corners(const std::vector<SurfacePart>& parts,
                                const std::vector<char>& freed, const std::vector<Index>& cones,
                                ExecutionContext& context);

// Per face: is the boundary of its part aligned, as with_corners() says? Closed parts: no.
std::vector<char> aligned_faces(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                const std::vector<Index>& cones);

// Edges on the boundary of a cut map that lie on an axis; `parent`: faces of the input, for which
// `aligned` says it.
std::vector<distortion::StraightEdge> straight_where(const std::vector<char>& aligned,
                                                     const std::vector<FaceId>& parent,
                                                     const distortion::CutMap& cut,
                                                     const mesh::Adjacency& adjacency);

}  // namespace flipfree::seamless
