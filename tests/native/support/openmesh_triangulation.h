// mesh::EditableTriangulation once more, on OpenMesh's half-edges: the judge of its operations.
// Elements are named by vertices, which both number alike; marks and parents are properties.
#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <array>
#include <span>
#include <tuple>
#include <vector>

#include "flipfree/mesh/refined/editable_triangulation.h"

namespace flipfree::test {

using Corners = mesh::EditableTriangulation::Triangle;

// What a triangulation is, whatever its slots are.
struct TriangulationState {
  std::vector<std::pair<Corners, FaceId>> faces;  // smallest corner first, with the parent; sorted
  std::vector<std::tuple<VertexId, VertexId, Index, bool>> edges;  // a < b, mark, boundary; sorted
  std::vector<std::vector<VertexId>> rings;  // counter-clockwise round each vertex, smallest first
  bool operator==(const TriangulationState&) const = default;
};
TriangulationState state_of(const mesh::EditableTriangulation& triangulation);

class OpenMeshTriangulation {
 public:
  OpenMeshTriangulation(Index vertex_count, const Triangles& faces);

  // As the functions of EditableTriangulation.
  void set_mark(VertexId a, VertexId b, Index mark);
  void split_edge(VertexId a, VertexId b);
  void split_face(const Corners& corners);
  void flip_edge(VertexId a, VertexId b);
  void replace(std::span<const Corners> faces, std::span<const Corners> triangles,
               std::span<const FaceId> parents);
  TriangulationState state() const;

 private:
  struct Traits : OpenMesh::DefaultTraits {
    VertexAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    FaceAttributes(OpenMesh::Attributes::Status);
  };
  using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

  Mesh::FaceHandle face(const Corners& corners) const;
  Mesh::EdgeHandle edge(VertexId a, VertexId b) const;
  void add_face(const Corners& corners, FaceId parent);

  Mesh mesh_;
  OpenMesh::EPropHandleT<Index> mark_;
  OpenMesh::FPropHandleT<FaceId> parent_;
};

}  // namespace flipfree::test
