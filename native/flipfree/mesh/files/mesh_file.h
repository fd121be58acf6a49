// Meshes in files: OBJ, PLY, OFF and STL, from bytes to arrays and back.
//
// Reading is ours but for STL. Writing is ours: OpenMesh 9 writes
// positions with 32 bits, loses small numbers to fixed notation, and knows no texture coordinates
// per corner in PLY (docs/architecture.md, "Mesh files").
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

enum class Format { kObj, kPly, kOff, kStl };

// By a path's ending, in any case. Throws InvalidInput (kBadFile), which lists what is known.
Format format_of(std::string_view path);

// True of formats that hold texture coordinates for every corner: OBJ and PLY.
bool holds_corner_uv(Format format);

// A mesh as it stands in a file, whatever its faces do: nothing is merged, oriented or dropped, but
// STL names no vertices: equal corners become one, and triangles left with two corners are none.
// Faces with fewer than three corners are none either, but are counted in the numbers of the
// others; texture coordinates that are not there, or are no numbers, are none, and then their whole
// polygon has none.
struct MeshFile {
  Points3 vertices;             // #V x 3, used by faces or not
  Triangles faces;              // #F x 3, polygons as they lie (mesh_file.cpp)
  std::vector<Index> polygons;  // #F, ascending: the file's polygon that a triangle is part of
  Triangles corners;            // #F x 3: which corner of the file, counted through its polygons
  Points2f uv;                  // 3 #F x 2, NaN where a polygon has none; no rows if none has
};

// Reads a file's bytes. Positions are 64-bit numbers as written, texture coordinates the 32-bit
// ones nearest to what is written. Materials, groups, normals, colours and lines are passed over,
// no other file is opened, the locale has no say. Throws InvalidInput (kBadFile) for bytes that are
// no such file, which names the line or element and what to do; never anything else but bad_alloc.
// Memory and time grow with the bytes, not with what they promise. Safe to call from any thread.
MeshFile read_mesh(std::string_view bytes, Format format);

// The file's bytes. Positions and texture coordinates have all their digits, so that reading gives
// the same bits; the triangles of one polygon become one face again, with its corners in the order
// of their numbers, unless these have several texture coordinates (the map is cut through it).
// Without `corners` triangles are faces. STL has 32-bit positions, and triangles. Preconditions:
// indices exist, positions are finite, uv has 3 #F rows or none, polygons #F entries or none,
// corners #F rows or none. Throws InvalidInput (kBadFile) for texture coordinates in a format
// without them, or that are not finite (NaN: as read).
std::string write_mesh(const MeshFile& mesh, Format format);

// The polygons of a file, by a strict reader for each format.
//
// OpenMesh's own readers serve STL alone, whose vertices have to be found. Of the others (tried
// with OpenMesh 9): an OBJ face `/1` aborts the process; `mtllib` opens any file; positions are
// rounded to 32 bits; a corner that repeats a vertex shifts the texture coordinates of the others;
// a PLY header without an end is read forever; PLY lists other than the faces', and bytes in ASCII,
// put all that follows out of step.

struct FilePolygons {
  std::vector<double> coordinates;  // 3 a vertex, as written; of STL one for each place
  std::vector<Index> corners;       // vertices of one polygon behind those of another
  std::vector<Index> begin{0};      // #polygons + 1, where each one's corners begin
  // Which of the file's faces each of these is: those with fewer than three corners are passed
  // over. None for STL: all.
  std::vector<Index> numbers;
  std::vector<float> uv;  // 2 a corner, NaN where there are none; empty if the format has none
};

// Each throws InvalidInput (kBadFile), naming the line or element.
FilePolygons read_obj(std::string_view bytes);
FilePolygons read_off(std::string_view bytes);
FilePolygons read_ply(std::string_view bytes);
FilePolygons read_stl(std::string_view bytes);

}  // namespace flipfree::mesh
