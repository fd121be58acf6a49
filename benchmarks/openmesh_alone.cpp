// SPDX-License-Identifier: GPL-3.0-or-later
// What OpenMesh's own readers do with files that docs/architecture.md names (Mesh files), each
// tried in a process of its own: an abort is a signal, what does not end in ten seconds an alarm.
#include <sys/wait.h>
#include <unistd.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <sstream>
#include <string>

namespace {

using OpenMesh::IO::Options;

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  HalfedgeAttributes(OpenMesh::Attributes::TexCoord2D);
};

void read_and_print(const std::string& file, const char* extension, Options options) {
  OpenMesh::PolyMesh_ArrayKernelT<Traits> mesh;
  std::istringstream stream(file);
  const bool read = OpenMesh::IO::read_mesh(mesh, stream, extension, options);
  std::cout << (read ? "read: " : "refused: ") << mesh.n_faces() << " faces,";
  for (const auto v : mesh.vertices()) std::cout << " (" << mesh.point(v) << ")";
  if (options.face_has_texcoord()) {
    for (const auto f : mesh.faces()) {
      std::cout << "\n  face " << f.idx() << ":";
      for (const auto h : mesh.fh_range(f))
        std::cout << " vertex " << mesh.to_vertex_handle(h).idx() << " at u "
                  << mesh.texcoord2D(h)[0];
    }
  }
  std::cout << std::endl;
}

void attempt(const char* what, const std::string& file, const char* extension,
             Options options = {}) {
  std::cout << "== " << what << std::endl;
  const pid_t child = fork();
  if (child == 0) {
    alarm(10);
    // OpenMesh says the same line as long as it reads.
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(1);
    read_and_print(file, extension, options);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) std::cout << strsignal(WTERMSIG(status)) << std::endl;
}

std::string ply(const std::string& properties, const std::string& vertices) {
  return "ply\nformat ascii 1.0\nelement vertex 3\n" + properties +
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n" + vertices +
         "3 0 1 2\n";
}

}  // namespace

int main() {
  std::cout.precision(17);
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  attempt("11 digits", "v 0.12345678901 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ".obj");
  attempt("OBJ, a face /1 2 3", triangle + "f /1 2 3\n", ".obj");
  attempt("OBJ, mtllib /dev/zero (watch it with strace)",
          "mtllib /dev/zero\n" + triangle + "f 1 2 3\n", ".obj");
  attempt("OBJ, a face with corners 1/1 1/2 2/3 3/4, at u 1 to 4",
          triangle + "vt 1 0\nvt 2 0\nvt 3 0\nvt 4 0\nf 1/1 1/2 2/3 3/4\n", ".obj",
          Options(Options::FaceTexCoord));
  attempt("PLY without end_header",
          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n", ".ply");
  attempt("PLY text, a property of bytes between x and y, custom properties asked for",
          ply("property float x\nproperty uchar a\nproperty float y\nproperty float z\n",
              "0 10 0 0\n1 20 0 0\n0 30 1 0\n"),
          ".ply", Options(Options::Custom));
  attempt("PLY text, a list of the vertices between x and y",
          ply("property float x\nproperty list uchar float a\nproperty float y\nproperty float z\n",
              "0 2 7 8 0 0\n1 1 7 0 0\n0 0 1 0\n"),
          ".ply");
  std::string stl(80, ' ');
  const std::uint32_t promised = 4000000000U;
  stl.append(reinterpret_cast<const char*>(&promised), sizeof promised);
  attempt("STL of no triangle that promises 4 billion", stl, ".stl", Options(Options::Binary));
}
