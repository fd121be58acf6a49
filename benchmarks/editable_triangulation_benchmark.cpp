// The operations of mesh::EditableTriangulation, and the same on OpenMesh's TriMesh_ArrayKernelT
// with properties for marks and parents: what the choice of our own arrays gains.
//
//   build/benchmarks/editable_triangulation_benchmark
//
// Argument: vertices per side of a triangulated grid. Every benchmark does one operation at
// (nearly) every place.
#include <benchmark/benchmark.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <array>
#include <vector>

#include "flipfree/mesh/refined/editable_triangulation.h"

namespace {

using namespace flipfree;
using mesh::EditableTriangulation;

Triangles grid(Index side) {
  Triangles faces(2 * (side - 1) * (side - 1), 3);
  Index f = 0;
  for (Index y = 0; y + 1 < side; ++y) {
    for (Index x = 0; x + 1 < side; ++x) {
      const Index v = y * side + x;
      faces.row(f++) << v, v + 1, v + side;
      faces.row(f++) << v + 1, v + side + 1, v + side;
    }
  }
  return faces;
}

struct Traits : OpenMesh::DefaultTraits {
  VertexAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
};

struct OpenMeshTriangulation {
  using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
  Mesh mesh;
  OpenMesh::EPropHandleT<Index> mark;
  OpenMesh::FPropHandleT<FaceId> parent;

  OpenMeshTriangulation(Index vertices, const Triangles& faces) {
    mesh.add_property(mark);
    mesh.add_property(parent);
    for (Index v = 0; v < vertices; ++v) mesh.add_vertex(Mesh::Point(0, 0, 0));
    for (FaceId f = 0; f < faces.rows(); ++f)
      mesh.property(
          parent, mesh.add_face(vertex(faces(f, 0)), vertex(faces(f, 1)), vertex(faces(f, 2)))) = f;
    for (const auto e : mesh.edges()) mesh.property(mark, e) = EditableTriangulation::kUnmarked;
  }
  static Mesh::VertexHandle vertex(Index v) { return Mesh::VertexHandle(v); }
};

void ours_build(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  const Triangles faces = grid(side);
  for (auto _ : state)
    benchmark::DoNotOptimize(EditableTriangulation(side * side, faces).vertex_count());
}
void openmesh_build(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  const Triangles faces = grid(side);
  for (auto _ : state)
    benchmark::DoNotOptimize(OpenMeshTriangulation(side * side, faces).mesh.n_vertices());
}

// All vertices' neighbours, with the marks of the edges to them.
void ours_visit(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  const EditableTriangulation t(side * side, grid(side));
  for (auto _ : state) {
    std::int64_t sum = 0;
    for (VertexId v = 0; v < t.vertex_count(); ++v)
      t.for_each_outgoing(v, [&](HalfedgeId h) { sum += t.target(h) + t.mark(h); });
    benchmark::DoNotOptimize(sum);
  }
}
void openmesh_visit(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  const OpenMeshTriangulation t(side * side, grid(side));
  for (auto _ : state) {
    std::int64_t sum = 0;
    for (const auto v : t.mesh.vertices())
      for (const auto h : t.mesh.voh_range(v))
        sum += t.mesh.to_vertex_handle(h).idx() + t.mesh.property(t.mark, t.mesh.edge_handle(h));
    benchmark::DoNotOptimize(sum);
  }
}

// The diagonals of all cells there and back.
void ours_flip(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  EditableTriangulation t(side * side, grid(side));
  for (auto _ : state) {
    for (Index y = 0; y + 1 < side; ++y) {
      for (Index x = 0; x + 1 < side; ++x) {
        const Index v = y * side + x;
        t.flip_edge(t.find(v + 1, v + side));
        t.flip_edge(t.find(v, v + side + 1));
      }
    }
  }
}
void openmesh_flip(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  OpenMeshTriangulation t(side * side, grid(side));
  const auto flip = [&](Index a, Index b) {
    const auto h = t.mesh.find_halfedge(t.vertex(a), t.vertex(b));
    const auto e = t.mesh.edge_handle(h);
    const FaceId left = t.mesh.property(t.parent, t.mesh.face_handle(h));
    const FaceId right =
        t.mesh.property(t.parent, t.mesh.face_handle(t.mesh.opposite_halfedge_handle(h)));
    t.mesh.flip(e);
    t.mesh.property(t.mark, e) = EditableTriangulation::kUnmarked;
    t.mesh.property(t.parent, t.mesh.face_handle(t.mesh.halfedge_handle(e, 0))) = left;
    t.mesh.property(t.parent, t.mesh.face_handle(t.mesh.halfedge_handle(e, 1))) = right;
  };
  for (auto _ : state) {
    for (Index y = 0; y + 1 < side; ++y) {
      for (Index x = 0; x + 1 < side; ++x) {
        const Index v = y * side + x;
        flip(v + 1, v + side);
        flip(v, v + side + 1);
      }
    }
  }
}

// Every edge split once; a fresh copy each time.
void ours_split_edges(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  const EditableTriangulation start(side * side, grid(side));
  for (auto _ : state) {
    EditableTriangulation t = start;
    for (HalfedgeId h = 0; h < start.halfedge_slots(); ++h)
      if (start.edge(h) == h) t.split_edge(h);
    benchmark::DoNotOptimize(t.vertex_count());
  }
}
void openmesh_split_edges(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  const OpenMeshTriangulation start(side * side, grid(side));
  for (auto _ : state) {
    OpenMeshTriangulation t = start;
    const std::size_t edges = start.mesh.n_edges();
    for (std::size_t i = 0; i < edges; ++i) {
      const OpenMeshTriangulation::Mesh::EdgeHandle e(static_cast<int>(i));
      const Index mark = t.mesh.property(t.mark, e);
      const auto h = t.mesh.halfedge_handle(e, 0);
      const auto a = t.mesh.from_vertex_handle(h), b = t.mesh.to_vertex_handle(h);
      const auto f = t.mesh.face_handle(h);
      const auto g = t.mesh.face_handle(t.mesh.opposite_halfedge_handle(h));
      const FaceId left = f.is_valid() ? t.mesh.property(t.parent, f) : kInvalid;
      const FaceId right = g.is_valid() ? t.mesh.property(t.parent, g) : kInvalid;
      const auto s = t.mesh.add_vertex(OpenMeshTriangulation::Mesh::Point(0, 0, 0));
      t.mesh.split(e, s);
      for (const auto out : t.mesh.voh_range(s)) {
        const auto to = t.mesh.to_vertex_handle(out);
        t.mesh.property(t.mark, t.mesh.edge_handle(out)) =
            to == a || to == b ? mark : EditableTriangulation::kUnmarked;
        const auto face = t.mesh.face_handle(out);
        if (face.is_valid()) t.mesh.property(t.parent, face) = face == f ? left : right;
      }
    }
    benchmark::DoNotOptimize(t.mesh.n_vertices());
  }
}

// A vertex put into every face and taken out again: faces die and are made.
void ours_replace(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  const Triangles faces = grid(side);
  const EditableTriangulation start(side * side, faces);
  for (auto _ : state) {
    EditableTriangulation t = start;
    for (FaceId f = 0; f < faces.rows(); ++f) {
      const EditableTriangulation::Triangle corners = t.corners(f);
      const VertexId s = t.split_face(f);
      const std::vector<FaceId> star = t.star(s);
      const std::array<EditableTriangulation::Triangle, 1> triangle = {corners};
      const std::array<FaceId, 1> parent = {t.parent(star[0])};
      t.replace(star, triangle, parent);
    }
    benchmark::DoNotOptimize(t.vertex_count());
  }
}
void openmesh_replace(benchmark::State& state) {
  const auto side = static_cast<Index>(state.range(0));
  const Triangles faces = grid(side);
  const OpenMeshTriangulation start(side * side, faces);
  for (auto _ : state) {
    OpenMeshTriangulation t = start;
    for (FaceId f = 0; f < faces.rows(); ++f) {
      const OpenMeshTriangulation::Mesh::FaceHandle face(f);
      const FaceId parent = t.mesh.property(t.parent, face);
      const auto s = t.mesh.add_vertex(OpenMeshTriangulation::Mesh::Point(0, 0, 0));
      t.mesh.split(face, s);
      for (const auto e : t.mesh.ve_range(s))
        t.mesh.property(t.mark, e) = EditableTriangulation::kUnmarked;
      std::vector<OpenMeshTriangulation::Mesh::FaceHandle> star;
      for (const auto g : t.mesh.vf_range(s)) {
        t.mesh.property(t.parent, g) = parent;
        star.push_back(g);
      }
      // A boundary edge dies with its only face, and its mark with it.
      std::array<Index, 3> marks{};
      for (Index k = 0; k < 3; ++k)
        marks[static_cast<std::size_t>(k)] =
            t.mesh.property(t.mark, t.mesh.edge_handle(t.mesh.find_halfedge(
                                        t.vertex(faces(f, k)), t.vertex(faces(f, (k + 1) % 3)))));
      for (const auto g : star) t.mesh.delete_face(g, false);
      const auto made =
          t.mesh.add_face(t.vertex(faces(f, 0)), t.vertex(faces(f, 1)), t.vertex(faces(f, 2)));
      t.mesh.property(t.parent, made) = parent;
      Index k = 0;
      for (const auto h : t.mesh.fh_range(made))
        t.mesh.property(t.mark, t.mesh.edge_handle(h)) = marks[static_cast<std::size_t>(k++)];
    }
    benchmark::DoNotOptimize(t.mesh.n_vertices());
  }
}

#define BOTH(operation)                                                          \
  BENCHMARK(ours_##operation)->Arg(30)->Arg(300)->Unit(benchmark::kMillisecond); \
  BENCHMARK(openmesh_##operation)->Arg(30)->Arg(300)->Unit(benchmark::kMillisecond)
BOTH(build);
BOTH(visit);
BOTH(flip);
BOTH(split_edges);
BOTH(replace);

}  // namespace

BENCHMARK_MAIN();
